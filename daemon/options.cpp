#include "daemon/options.h"

#include <getopt.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>

#include "hal/error.h"

namespace emtb {

const char* const options_help =
    "Runs a DC-motor test bench: reads it, drives its reference, records it, keeps it safe.\n"
    "\n"
    "emtbd --config BENCH.yaml [OPTIONS]\n"
    "  --config FILE      the bench\n"
    "  --socket PATH      where `emtb` finds it [$XDG_RUNTIME_DIR/emtb.sock, or /run/emtb/emtb.sock]\n"
    "  --data DIR         where sessions go [./sessions]\n"
    "  --pace N|max       simulated benches and replays: run experiments at N times real time, or as fast as possible\n"
    "                     [as the bench says, usually 1]\n"
    "  --replay SESSION   plays a recorded session, PATH[#RUN] of .h5 or .csv, in the place of the bench's devices, "
    "none\n"
    "                     of which is touched: `emtb run replay` records it anew, judged by the bench's limits\n"
    "  --safe             only makes the reference output safe, and ends\n"
    "  --repair SESSION   only repairs a session whose recording ended abruptly, and ends; a daemon does so by itself "
    "for\n"
    "                     those in its folder, once the bench is in service\n"
    "  --help, --version\n"
    "\n"
    "It starts latched: `emtb reset` arms it. Software alone does not make a bench safe: the driver's enable belongs "
    "on a\n"
    "hardware interlock with an emergency stop.\n";

namespace {

double parse_pace(const std::string& text) {
  if (text == "max") return std::numeric_limits<double>::infinity();
  char* end = nullptr;
  const double pace = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !std::isfinite(pace) || pace <= 0) {
    throw Error("--pace " + text + ": give a number above 0, or max");
  }
  return pace;
}

}  // namespace

Options parse_options(int argc, char** argv) {
  enum { config = 1, socket, data, replay, repair, safe, pace, help, tell_version };
  const option known[] = {
      {"config", required_argument, nullptr, config},  {"socket", required_argument, nullptr, socket},
      {"data", required_argument, nullptr, data},      {"replay", required_argument, nullptr, replay},
      {"repair", required_argument, nullptr, repair},  {"safe", no_argument, nullptr, safe},
      {"pace", required_argument, nullptr, pace},      {"help", no_argument, nullptr, help},
      {"version", no_argument, nullptr, tell_version}, {nullptr, 0, nullptr, 0}};
  Options options;
  optind = 1;
  opterr = 0;  // our own message, one line like all others
  while (true) {
    const int at = optind;
    const int found = getopt_long(argc, argv, ":", known, nullptr);
    if (found == -1) break;
    switch (found) {
      case config:
        options.config = optarg;
        break;
      case socket:
        options.socket = optarg;
        break;
      case data:
        options.data = optarg;
        break;
      case replay:
        options.replay = optarg;
        break;
      case repair:
        options.repair = optarg;
        break;
      case safe:
        options.safe = true;
        break;
      case pace:
        options.pace = parse_pace(optarg);
        break;
      case help:
        options.help = true;
        return options;
      case tell_version:
        options.version = true;
        return options;
      case ':':
        throw Error(std::string(argv[at]) + " wants a value. See emtbd --help");
      default:
        throw Error(std::string(argv[at]) + ": no such option. See emtbd --help");
    }
  }
  if (optind < argc) throw Error(std::string(argv[optind]) + ": unexpected. See emtbd --help");
  if (options.config.empty() && options.repair.empty()) throw Error("--config BENCH.yaml is missing. See emtbd --help");
  return options;
}

}  // namespace emtb
