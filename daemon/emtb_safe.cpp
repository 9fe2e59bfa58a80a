// emtb-safe --config BENCH.yaml: what `emtbd --safe` does, as a program that is quick to start.
//
// emtbd loads HDF5 and with it some fifty libraries before its first line runs. After a kill -9 the motor turns on
// meanwhile. This program links only what opens a reference output. As `emtb-safe --guard` it stands beside every
// daemon (daemon/guardian.h).

#include <cstdio>
#include <cstring>

#include "daemon/guardian.h"
#include "daemon/make_safe.h"
#include "hal/standard_streams.h"

int main(int argc, char** argv) {
  emtb::have_standard_streams();
  if (argc == 4 && std::strcmp(argv[1], "--config") == 0 && std::strcmp(argv[3], "--guard") == 0) {
    return emtb::keep_guard(argv[2], "emtb-safe");  // started by emtbd, not by people
  }
  if (argc == 3 && std::strcmp(argv[1], "--config") == 0) return emtb::make_safe(argv[2], "emtb-safe");
  const bool help = argc == 2 && std::strcmp(argv[1], "--help") == 0;
  std::fputs(help ? "Makes the reference output of a bench safe, and ends.\n\nemtb-safe --config BENCH.yaml\n"
                  : "emtb-safe: --config BENCH.yaml, and nothing else, is wanted\n",
             help ? stdout : stderr);
  return help ? 0 : 2;
}
