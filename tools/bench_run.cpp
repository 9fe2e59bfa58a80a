#include "tools/bench_run.h"

#include <signal.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "hal/signal.h"
#include "tools/progress.h"
#include "tools/text.h"

namespace emtb {
namespace {

using nlohmann::json;

volatile sig_atomic_t interrupt_seen = 0;

/// With one place after the point, also where that is 0: a time that runs does not jump in width.
std::string tenths(const json& value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", value.get<double>());
  return text;
}

}  // namespace

void catch_interrupt() {
  struct sigaction action {};
  action.sa_handler = [](int) { interrupt_seen = 1; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);  // and no SA_RESTART: poll() shall return
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() { return interrupt_seen != 0; }

std::string signals_in_words(const json& signals) {
  std::string line;
  for (const Signal signal : all_signals()) {
    const auto found = signals.find(info(signal).name);
    if (found == signals.end()) continue;
    const json& value = found->is_object() ? (*found)["value"] : *found;
    line += (line.empty() ? "" : "  ") + std::string(info(signal).name) + " " +
            (value.is_number() ? pretty(value.get<double>()) : "-") + " " +
            std::string(info(signal).unit == "1" ? "" : info(signal).unit);
  }
  return line;
}

std::string run_in_words(const json& run) {
  return run["profile"].get<std::string>() + " " + tenths(run["t"]) + "/" + tenths(run["duration"]) + " s";
}

json run_on_bench(Client& daemon, const json& wish) {
  const json started = daemon.call("run", wish);
  Progress progress;
  bool stopping = false;
  while (true) {
    if (interrupted() && !stopping) {
      stopping = true;
      daemon.call("stop", json::object());
    }
    const auto message = daemon.notification(0.2);
    if (!message) continue;
    const json& now = (*message)["params"];
    if ((*message)["method"] == "live" && !now["run"].is_null()) {
      progress.show(now["run"]["t"].get<double>() / now["run"]["duration"].get<double>(),
                    run_in_words(now["run"]) + "  " + signals_in_words(now["signals"]));
    }
    if ((*message)["method"] == "ended" && now["run"] == started["run"]) return now;
  }
}

}  // namespace emtb
