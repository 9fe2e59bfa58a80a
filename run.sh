#!/usr/bin/env bash
# Installs what is missing, builds, and plays the story on the simulated bench: from a device to a verdict. On a terminal it then
# serves the page over the story's sessions until Ctrl-C; otherwise it says how to.
set -euo pipefail
cd "$(dirname "$0")"

tools/install_packages.sh --run
mkdir -p build
cmake --preset release >build/build.log 2>&1 || { tail -30 build/build.log >&2; exit 1; }
echo "building (the first time takes some minutes) ..."
# On a terminal it says how far it is; in a pipe that would be thousands of lines.
how_far() {
  while IFS= read -r line; do
    if [ -t 1 ] && [[ $line =~ ^\[([0-9]+/[0-9]+)\] ]]; then printf '\r%s ' "${BASH_REMATCH[1]}"; fi
  done
  if [ -t 1 ]; then echo; fi
}
cmake --build --preset release --target emtb emtbd emtb-safe emtb-plant 2>&1 | tee build/build.log | how_far ||
  { tail -30 build/build.log >&2; exit 1; }
tools/story.sh

story=${EMTB_STORY:-build/story}
page=(build/release/bin/emtb page config/models/fh2.yaml "$story"/{step_low,step_high,ramp,random}.h5 --held-out "$story"/{step_mid,staircase}.h5)
if [ -t 0 ] && [ -t 1 ]; then
  printf '\n\033[1m8. The page, over these sessions: open the address; Ctrl-C ends it\033[0m\n'
  exec "${page[@]}"
fi
printf '\n8. The page, over these sessions:\n%s\n' "${page[*]}"
