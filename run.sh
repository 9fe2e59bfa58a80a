#!/usr/bin/env bash
# Installs what is missing, builds, and plays the story on the simulated bench: from a device to a verdict.
set -euo pipefail
cd "$(dirname "$0")"

tools/install_packages.sh
mkdir -p build
cmake --preset release >build/build.log 2>&1 || { tail -30 build/build.log >&2; exit 1; }
echo "building (the first time takes some minutes) ..."
cmake --build --preset release --target emtb emtbd emtb-safe emtb-plant >build/build.log 2>&1 || { tail -30 build/build.log >&2; exit 1; }
exec tools/story.sh
