#include <getopt.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>

#include <atomic>
#include <cstdio>
#include <iostream>
#include <string>

#include "drivers/simulated/plant_process.h"
#include "hal/error.h"

namespace {

const char* const help =
    "The plant of a simulated bench in a process of its own: it outlives the daemon, and holds the reference "
    "meanwhile.\n"
    "\n"
    "emtb-plant --config BENCH.yaml [--log FILE]\n"
    "  --config FILE  the bench; its simulation.process is the name by which emtbd finds the plant\n"
    "  --log FILE     writes each change of the reference: t_s (CLOCK_MONOTONIC), u_ref_V\n"
    "  --help\n"
    "\n"
    "Then: emtbd --config BENCH.yaml. SIGTERM or Ctrl-C ends the plant.\n";

std::atomic<bool> quit{false};

struct Options {
  std::string config;
  std::string log;
  bool help = false;
};

Options parse(int argc, char** argv) {
  const option known[] = {{"config", required_argument, nullptr, 'c'},
                          {"log", required_argument, nullptr, 'l'},
                          {"help", no_argument, nullptr, 'h'},
                          {nullptr, 0, nullptr, 0}};
  Options options;
  opterr = 0;
  while (true) {
    const int at = optind;
    const int found = getopt_long(argc, argv, ":", known, nullptr);
    if (found == -1) break;
    if (found == 'c') options.config = optarg;
    if (found == 'l') options.log = optarg;
    if (found == 'h') options.help = true;
    if (found == ':') throw emtb::Error(std::string(argv[at]) + " wants a value. See emtb-plant --help");
    if (found == '?') throw emtb::Error(std::string(argv[at]) + ": no such option. See emtb-plant --help");
  }
  if (optind < argc) throw emtb::Error(std::string(argv[optind]) + ": unexpected. See emtb-plant --help");
  if (!options.help && options.config.empty())
    throw emtb::Error("--config BENCH.yaml is missing. See emtb-plant --help");
  return options;
}

/// A card does not wait until a processor is free. Below the daemon's loop; where it is not allowed, it still runs.
void prefer_real_time() {
  constexpr int priority = 70;
  const sched_param parameters{.sched_priority = priority};
  pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const Options options = parse(argc, argv);
    if (options.help) {
      std::cout << help;
      return 0;
    }
    struct sigaction action {};
    action.sa_handler = [](int) { quit = true; };
    for (const int ending : {SIGTERM, SIGINT, SIGHUP}) sigaction(ending, &action, nullptr);

    const emtb::BenchConfig bench = emtb::read_bench(options.config);
    emtb::simulated::PlantProcess plant(bench);
    std::FILE* log = nullptr;
    if (!options.log.empty()) {
      log = std::fopen(options.log.c_str(), "w");
      if (log == nullptr) throw emtb::Error(options.log + ": cannot be written");
      std::fprintf(log, "t_s,u_ref_V\n");
    }
    prefer_real_time();
    std::cout << "emtb-plant: " << bench.name << " lives" << std::endl;
    plant.run(quit, [log](double t, double volts) {
      if (log == nullptr) return;
      std::fprintf(log, "%.6f,%.6f\n", t, volts);
      std::fflush(log);  // whoever reads it wants to know now
    });
    if (log != nullptr) std::fclose(log);
    return 0;
  } catch (const std::exception& e) {
    std::cerr << "emtb-plant: " << e.what() << "\n";
    return 2;
  }
}
