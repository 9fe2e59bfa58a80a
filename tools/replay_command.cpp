#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "hal/error.h"
#include "report/result_json.h"
#include "session/spec.h"
#include "tools/bench_run.h"
#include "tools/commands.h"
#include "tools/own_daemon.h"

namespace emtb {
namespace {

using nlohmann::json;

struct ReplayOptions {
  std::string session;
  std::string bench;
  std::string pace = "max";
  std::string data = "sessions";
  std::string json_file;
};

/// The bench that judges: the one that was named, else the one that the session was recorded on.
std::string bench_of(const ReplayOptions& options, const std::filesystem::path& folder) {
  if (!options.bench.empty()) return options.bench;
  const std::string text = read_session(parse_session_spec(options.session).path).config;
  if (text.empty()) {
    throw Error(options.session + ": does not hold the bench it was recorded on. Name one with --config BENCH.yaml");
  }
  const auto file = folder / "bench.yaml";
  std::ofstream(file) << text;
  return file;
}

int replay(const ReplayOptions& options) {
  OwnDaemon emtbd;
  const auto daemon = emtbd.start(bench_of(options, emtbd.folder()), options.data,
                                  {"--replay", options.session, "--pace", options.pace});
  daemon->call("subscribe", {{"rate", 10}});
  daemon->call("reset", json::object());
  catch_interrupt();
  const json ended = run_on_bench(*daemon, {{"profile", "replay"}});
  write_json(options.json_file, ended);
  std::cout << ended["session"].get<std::string>() << std::endl;
  if (ended["outcome"] == "done") return 0;
  std::cerr << "emtb: the replay ended at " << ended["t"].dump() << " s: " << why_it_ended(ended) << "\n";
  return 1;
}

}  // namespace

void add_replay_command(CommandLine& line) {
  const auto options = std::make_shared<ReplayOptions>();
  line.command("replay",
               "plays a recorded session to the daemon's loop, with no device, and prints where the new session is")
      .argument("SESSION", options->session, "PATH[#RUN] of .h5 or .csv")
      .option("--config", options->bench, "the bench whose limits judge it [the one it was recorded on]")
      .option("--pace", options->pace, "N times real time, or max [max]")
      .offers([] {
        return std::vector<std::string>{"max", "1"};
      })
      .option("--data", options->data, "where the new session goes [./sessions]")
      .option("--json", options->json_file, "writes how it ended to this file; - for standard output")
      .action([options] { return replay(*options); });
}

}  // namespace emtb
