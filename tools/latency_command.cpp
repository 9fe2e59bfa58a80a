#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "hal/error.h"
#include "report/progress.h"
#include "report/result_json.h"
#include "server/client.h"
#include "tools/commands.h"
#include "tools/own_daemon.h"

namespace emtb {
namespace {

using nlohmann::json;

constexpr double good_lateness = 0.25;  // periods, of 99 % of the ticks: the reference is where it belongs
constexpr double good_work = 0.5;       // periods, of 99 %: half of the time is left for bad moments
constexpr double good_missed = 1e-4;    // of all deadlines
constexpr double bad_missed = 1e-2;

struct LatencyOptions {
  std::shared_ptr<const std::string> socket;
  std::string config;
  std::string json_file;
  double seconds = 10;
};

using Histogram = std::map<double, double>;  // upper edge [us] -> how often

Histogram difference(const json& before, const json& after) {
  Histogram bins;
  for (const json& bin : after) bins[bin[0]] += bin[1].get<double>();
  for (const json& bin : before) bins[bin[0]] -= bin[1].get<double>();
  std::erase_if(bins, [](const auto& bin) { return bin.second <= 0; });
  return bins;
}

double percentile(const Histogram& bins, double share) {  // [us]
  double total = 0, below = 0;
  for (const auto& [edge, count] : bins) total += count;
  for (const auto& [edge, count] : bins) {
    below += count;
    if (below >= share * total) return edge;
  }
  return 0;
}

json figures(const Histogram& bins) {
  return {{"p50", percentile(bins, 0.5)},
          {"p99", percentile(bins, 0.99)},
          {"p999", percentile(bins, 0.999)},
          {"max", percentile(bins, 1)}};
}

void print(const char* what, const json& us) {
  std::printf("%s %.0f us (half of the ticks), %.0f (99 %%), %.0f (99.9 %%), %.0f at most\n", what,
              us["p50"].get<double>(), us["p99"].get<double>(), us["p999"].get<double>(), us["max"].get<double>());
}

int measure(Client& daemon, const LatencyOptions& options) {
  Progress progress;
  const json before = daemon.call("status", json::object());
  const auto start = std::chrono::steady_clock::now();
  const auto passed = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  while (passed() < options.seconds) {
    progress.show(passed() / options.seconds, "measuring");
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  progress.show(1, "");
  const json after = daemon.call("status", json::object());

  const double rate = after["loop"]["rate"];
  const double period = 1e6 / rate;  // [us]
  const json late = figures(difference(before["loop"]["late_histogram"], after["loop"]["late_histogram"]));
  const json work = figures(difference(before["loop"]["work_histogram"], after["loop"]["work_histogram"]));
  const double ticks = after["loop"]["ticks"].get<double>() - before["loop"]["ticks"].get<double>();
  const double missed = after["loop"]["missed"].get<double>() - before["loop"]["missed"].get<double>();
  const double share = missed / std::max(1.0, ticks + missed);
  const bool punctual = late["p99"] <= good_lateness * period && work["p99"] <= good_work * period;
  const bool fits = late["p99"].get<double>() + work["p99"].get<double>() < period && share <= bad_missed;
  const char* word = !fits ? "no" : punctual && share <= good_missed ? "good" : "usable";
  write_json(options.json_file, {{"bench", after["bench"]},
                                 {"rate", rate},
                                 {"seconds", options.seconds},
                                 {"late_us", late},
                                 {"work_us", work},
                                 {"ticks", ticks},
                                 {"missed", missed},
                                 {"realtime", after["realtime"]},
                                 {"answer", word}});
  if (options.json_file == "-") return fits ? 0 : 1;

  std::printf("%s at %g Hz, %.0f ticks:\n", after["bench"].get<std::string>().c_str(), rate, ticks);
  print("woke late by", late);
  print("worked for", work);
  std::printf("missed %.0f of %.0f deadlines\n", missed, ticks + missed);
  if (punctual && share <= good_missed) {
    std::printf("This computer is good enough for %g Hz with these devices.\n", rate);
  } else if (fits) {
    std::printf("Usable: it keeps %g Hz, but not punctually. Deadlines that it misses stand in the session as gaps.\n",
                rate);
  } else {
    std::printf("Not good enough for %g Hz. Lower `rate` in the bench file, or relieve the computer.\n", rate);
  }
  for (const json& step : after["realtime"]) {
    if (step["ok"].get<bool>()) continue;
    std::printf("It would help: %s (%s)\n", step["what"].get<std::string>().c_str(),
                step["why"].get<std::string>().c_str());
  }
  return fits ? 0 : 1;
}

int latency(const LatencyOptions& options) {
  if (!(options.seconds > 0 && options.seconds <= 86'400)) throw Error("--seconds: must be above 0, a day at most");
  if (options.config.empty()) {
    Client daemon = daemon_at(*options.socket);
    return measure(daemon, options);
  }
  OwnDaemon emtbd;  // latched, on the bench's devices
  const auto daemon = emtbd.start(options.config, emtbd.folder() / "data");
  return measure(*daemon, options);
}

}  // namespace

void add_latency_command(CommandLine& line, const std::shared_ptr<const std::string>& socket) {
  const auto options = std::make_shared<LatencyOptions>();
  options->socket = socket;
  line.command("latency",
               "whether this computer is good enough for the bench's rate: how late the loop wakes, how long it works")
      .option("--config", options->config, "starts a daemon of its own on this bench, latched [asks the one that runs]")
      .option("--seconds", options->seconds, "[s] how long")
      .option("--json", options->json_file, "writes it all to this file; - for standard output")
      .action([options] { return latency(*options); });
}

}  // namespace emtb
