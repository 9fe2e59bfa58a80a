#!/usr/bin/env bash
# Installs the Debian packages that packages.txt names and this machine lacks.
#   install_packages.sh [--run]    --run: without those that only tests need
set -euo pipefail
cd "$(dirname "$0")/.."

[ "${1:-}" = --run ] && until='/^# only tests/,$ d' || until=''
missing=()
while read -r package command; do
  [ -n "$command" ] && command -v "$command" >/dev/null && continue
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' || missing+=("$package")
done < <(sed -e "$until" -e 's/#.*//' -e '/^[[:space:]]*$/d' packages.txt)
[ ${#missing[@]} -eq 0 ] && exit 0

echo "installing: ${missing[*]}"
as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "install_packages: needs root, or sudo, to install: ${missing[*]}" >&2; exit 2; }
  as_root=(sudo)
fi
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
