#!/usr/bin/env bash
# emtb's speed beside its peers, on this machine: docs/performance.md says what is compared and how.
#   tests/benchmark/run.sh [--json FILE] [--only KEY]... [--quick] [--list]
# Installs the peers that are missing (Debian packages); nothing of the normal build needs them.
set -euo pipefail
cd "$(dirname "$0")/../.."

peers=(python3-numpy python3-scipy python3-pandas libsundials-dev libboost-dev)
missing=()
for package in "${peers[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' || missing+=("$package")
done
if [ ${#missing[@]} -gt 0 ]; then
  echo "installing: ${missing[*]}" >&2
  as_root=()
  [ "$(id -u)" -eq 0 ] || as_root=(sudo)
  "${as_root[@]}" apt-get update -qq >&2 || true
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >&2 ||
    echo "run.sh: not all could be installed; what needs them will be null" >&2
fi
if [ ! -x build/release/bin/emtb ] || [ ! -x build/release/bin/benchmark_runs ] || [ ! -x build/release/bin/fit_time ]; then
  cmake --preset release >/dev/null
  cmake --build --preset release --target emtb benchmark_runs fit_time >&2
fi
exec /usr/bin/python3 tests/benchmark/peers.py "$@"
