#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "config/model.h"
#include "config/profile.h"
#include "config/profile_path.h"
#include "hal/error.h"
#include "hal/signal.h"
#include "report/estimates_table.h"
#include "report/live_plot.h"
#include "report/result_json.h"
#include "report/text.h"
#include "server/client.h"
#include "server/unix_socket.h"
#include "tools/bench_run.h"
#include "tools/commands.h"
#include "tools/offered_words.h"

namespace emtb {
namespace {

using nlohmann::json;

std::string number(const json& value) { return value.is_number() ? pretty(value.get<double>()) : "-"; }

/// `clock of e_a, omega: fast by 39.8 ppm (+-0.5)`.
std::string clock_in_words(const json& clock) {
  std::string words;
  for (const json& signal : clock["signals"]) words += (words.empty() ? "clock of " : ", ") + signal.get<std::string>();
  if (clock["std_error_ppm"].is_null()) return words + ": not known yet";
  const double fast = clock["fast_ppm"];
  return words + (fast < 0 ? ": slow by " : ": fast by ") + pretty(std::abs(fast), 3) + " ppm (+-" +
         pretty(clock["std_error_ppm"].get<double>(), 2) + ")";
}

struct DaemonOptions {
  std::shared_ptr<const std::string> socket;
  std::string json_file;
  std::string profile;
  std::string note;
  std::string operator_name;
  std::string brake;
  std::string model;
  int repeat = 1;
  bool reset = false, plot = false, watch = false;
  double rate = 10;     // [Hz]
  double seconds = 30;  // shown by --plot

  Client connect() const { return daemon_at(*socket); }
};

int status(const DaemonOptions& options) {
  Client daemon = options.connect();
  const json now = daemon.call("status", json::object());
  write_json(options.json_file, now);
  if (options.json_file == "-") return 0;
  std::cout << now["bench"].get<std::string>() << ": " << now["state"].get<std::string>();
  if (!now["fault"].is_null()) std::cout << ": " << now["fault"]["text"].get<std::string>();
  std::cout << "\n" << signals_in_words(now["signals"]) << "\n";
  if (!now["reference_safe"].get<bool>()) std::cout << "THE REFERENCE DOES NOT GO SAFE: switch the driver off\n";
  if (!now["run"].is_null()) {
    const json& who = now["run"]["controller"];
    std::cout << "run " << run_in_words(now["run"]) << " by " << who["user"].get<std::string>() << ", process "
              << who["pid"].dump() << ": " << now["run"]["session"].get<std::string>() << "\n";
  }
  if (!now["last_run"].is_null()) {
    const json& last = now["last_run"];
    std::cout << "last run: " << last["outcome"].get<std::string>()
              << (last["fault"].is_null() ? "" : ": " + last["fault"]["text"].get<std::string>()) << ": "
              << last["session"].get<std::string>() << "\n";
  }
  const json& late = now["loop"]["late_us"];
  std::cout << "loop: " << number(now["loop"]["rate"]) << " Hz, late " << number(late["p50"]) << " us typically, "
            << number(late["p99"]) << " us in 1 % of the ticks, " << now["loop"]["missed"].dump()
            << " deadlines missed; works for " << number(now["loop"]["work_us"]["p50"]) << " us typically\n";
  for (const json& clock : now["clocks"]) std::cout << clock_in_words(clock) << "\n";
  if (!now["black_box"].is_null()) std::cout << "black box: " << now["black_box"].get<std::string>() << "\n";
  return 0;
}

int watch(const DaemonOptions& options) {
  if (!(options.seconds > 0)) throw Error("--seconds: must be more than 0");
  Client daemon = options.connect();
  daemon.call("subscribe", {{"rate", options.rate}});
  catch_interrupt();
  const bool terminal = isatty(STDOUT_FILENO) == 1;
  LivePlot plot(options.seconds);
  std::ptrdiff_t lines = 0;  // of the plot that is on the screen
  const auto start = std::chrono::steady_clock::now();
  while (!interrupted()) {
    const auto message = daemon.notification(0.5);
    if (!message || (*message)["method"] != "live") continue;
    const json& now = (*message)["params"];
    if (options.plot) {
      const std::chrono::duration<double> t = std::chrono::steady_clock::now() - start;
      const auto reading = [&](Signal signal) {
        const auto found = now["signals"].find(info(signal).name);
        return found != now["signals"].end() && found->is_number() ? found->get<double>() : std::nan("");
      };
      plot.add(t.count(), reading(Signal::omega), reading(Signal::i_a));
      const std::string text = plot.text(style_of_stdout());
      if (terminal && lines > 0) std::cout << "\r\033[" << lines << "A\033[J";
      std::cout << text;
      lines = std::ranges::count(text, '\n');
    }
    std::string line = now["state"].get<std::string>();
    if (!now["run"].is_null()) line += " " + run_in_words(now["run"]);
    line += "  " + signals_in_words(now["signals"]);
    if (!now["fault"].is_null()) line += "  " + now["fault"]["text"].get<std::string>();
    std::cout << (terminal ? "\r\033[K" : "") << line << (terminal ? "" : "\n") << std::flush;
    if (!std::cout) break;  // nobody listens any more
  }
  if (terminal) std::cout << "\n";
  return 0;
}

/// What the daemon is told: the text of a file, read with our user's rights; else the name, for it to look up.
std::string profile_parameter(const std::string& profile) {
  std::error_code ignored;
  if (is_profile_name(profile) && !std::filesystem::is_regular_file(profile, ignored)) return profile;
  std::string text = YamlMap::read_text(profile);
  const YamlMap yaml = YamlMap::parse(text, profile);
  if (yaml.text_or("kind", "") == "from_csv") text = self_contained(YamlMap::load(profile));
  constexpr std::size_t rest = 4096;  // of the request: note, operator
  if (text.size() + rest > UnixSocketServer::longest_run) {
    throw ConfigError(profile + ": is " + std::to_string(text.size() / 1024) +
                      " KiB with its points, but a daemon takes " +
                      std::to_string((UnixSocketServer::longest_run - rest) / 1024) + ". Give fewer points");
  }
  if (text.find('\n') == std::string::npos) text += "\n";  // marks it as a text
  return text;
}

int run(const DaemonOptions& options) {
  Client daemon = options.connect();
  daemon.call("subscribe", {{"rate", 10}});
  if (options.reset) daemon.call("reset", json::object());
  json wish = {{"profile", profile_parameter(options.profile)}, {"note", options.note}};
  if (!options.operator_name.empty()) wish["operator"] = options.operator_name;
  if (!options.brake.empty()) wish["brake"] = options.brake;
  if (options.repeat < 1) throw Error("--repeat: must be 1 or more");
  catch_interrupt();
  json ended;
  for (int i = 0; i < options.repeat; ++i) {
    ended = run_on_bench(daemon, wish);
    std::cout << ended["session"].get<std::string>() << std::endl;
    if (ended["outcome"] != "done") break;
  }
  write_json(options.json_file, ended);
  if (ended["outcome"] == "done") return 0;
  std::cerr << "emtb: the run ended early: " << why_it_ended(ended) << "\n";
  return 1;
}

int stop(const DaemonOptions& options) {
  const json stopped = stop_now(socket_to_call(*options.socket));
  if (stopped["stopped"].is_null()) std::cerr << "emtb: no run is on\n";
  if (stopped.value("reference_safe", true)) return 0;
  std::cerr << "emtb: THE REFERENCE MAY NOT BE SAFE: switch the driver off\n";
  return 1;
}

int reset(const DaemonOptions& options) {
  try {
    options.connect().call("reset", json::object());
  } catch (const rpc::Refusal& refusal) {
    if (refusal.code() != rpc::code::cause_stands) throw;
    std::cerr << "emtb: " << refusal.what() << "\n";  // no mistake of the caller's: the answer is no
    return 1;
  }
  return 0;
}

int confirm(const DaemonOptions& options) {
  options.connect().call("confirm", json::object());
  return 0;
}

int estimates(const DaemonOptions& options) {
  Client daemon = options.connect();
  json wish = json::object();
  if (!options.model.empty()) wish["model"] = to_yaml(read_model(options.model));
  const json now = daemon.call("estimates", wish);
  write_json(options.json_file, now);
  if (options.json_file != "-") std::cout << estimates_table(now);
  if (!options.watch) return 0;
  daemon.call("subscribe", {{"rate", options.rate}, {"estimates", true}});
  catch_interrupt();
  const bool terminal = isatty(STDOUT_FILENO) == 1;
  std::ptrdiff_t lines = std::ranges::count(estimates_table(now), '\n');  // that are on the screen
  while (!interrupted() && std::cout) {
    const auto message = daemon.notification(0.5);
    if (!message || (*message)["method"] != "live") continue;
    const json& latest = (*message)["params"]["estimates"];
    if (latest.is_null()) continue;
    if (options.json_file == "-") {
      std::cout << latest.dump() << std::endl;
      continue;
    }
    const std::string table = estimates_table(latest);
    if (terminal) std::cout << "\r\033[" << lines << "A\033[J";
    std::cout << table << (terminal ? "" : "\n") << std::flush;
    lines = std::ranges::count(table, '\n');
  }
  return 0;
}

}  // namespace

void add_daemon_commands(CommandLine& line, const std::shared_ptr<const std::string>& socket) {
  const auto options = std::make_shared<DaemonOptions>();
  options->socket = socket;
  const auto act = [&options](int (*command)(const DaemonOptions&)) {
    return [options, command] { return command(*options); };
  };

  line.command("status", "what the daemon and its bench are doing")
      .option("--json", options->json_file, "writes it all to this file; - for standard output")
      .action(act(status));
  line.command("watch", "shows the signals as they are measured, until Ctrl-C")
      .option("--rate", options->rate, "[Hz] lines a second, 50 at most")
      .flag("--plot", options->plot, "draws speed and current as they come")
      .option("--seconds", options->seconds, "[s] how far back --plot shows")
      .action(act(watch));
  line.command("run", "runs an experiment and prints where its session is; Ctrl-C stops it")
      .argument("PROFILE", options->profile, "a profile's file, or the name of one that the daemon knows")
      .offers_beside_files(profile_names)
      .flag("--reset", options->reset, "arms the bench first; see that it is safe")
      .option("--note", options->note, "kept in the session")
      .option("--operator", options->operator_name, "who is responsible, kept in the session [you]")
      .option("--brake", options->brake, "how the brake is set, kept in the session")
      .option("--repeat", options->repeat, "so many runs, one after the other, until one ends early")
      .option("--json", options->json_file, "writes how the (last) run ended to this file; - for standard output")
      .action(act(run));
  line.command("stop", "ends the run that is on; the reference goes to its safe value").action(act(stop));
  line.command("confirm", "goes on with a run that waits for a person; press Enter in `emtb run` for the same")
      .action(act(confirm));
  line.command("reset", "arms the bench, where no cause against it stands").action(act(reset));
  line.command("estimates", "the live estimates of the daemon: parameters, states, how far the model is off")
      .flag("--watch", options->watch, "shows them as they come, until Ctrl-C")
      .option("--rate", options->rate, "[Hz] of --watch, 50 at most")
      .option("--model", options->model, "a model file for the daemon to follow from now on; nothing moves")
      .option("--json", options->json_file, "writes them to this file; - for standard output")
      .action(act(estimates));
}

}  // namespace emtb
