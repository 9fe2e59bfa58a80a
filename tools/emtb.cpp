#include <malloc.h>

#include "emtb/version.h"
#include "hal/standard_streams.h"
#include "tools/commands.h"

namespace {

/// The order of the help: that in which a person with a motor comes to need them.
void group(emtb::CommandLine& line) {
  line.group("Bench, through the daemon emtbd",
             {"status", "watch", "run", "stop", "confirm", "reset", "estimates", "investigate"});
  line.group("Before a bench runs", {"devices", "config", "bench", "latency", "profiles"});
  line.group("Recorded sessions", {"check", "info", "import", "export", "replay"});
  line.group("What the model is missing", {"diagnose", "add", "discover", "trend", "report", "page", "effects"});
  line.group("The model itself", {"estimate", "calibrate", "compare", "simulate", "table", "batch"});
  line.group("The model elsewhere", {"export-model", "gains"});
  line.group("About emtb", {"help", "paper"});
}

/// What one thread lets go of, another may have: the columns of an hour else stay behind in the arenas of threads that
/// have ended.
void share_freed_memory() {
#ifdef __GLIBC__
  mallopt(M_ARENA_MAX, 1);
#endif
}

}  // namespace

int main(int argc, char** argv) {
  share_freed_memory();
  emtb::have_standard_streams();
  const std::string commit = emtb::commit;
  emtb::CommandLine line("Runs a DC-motor test bench, and finds out what the model of the motor is missing.",
                         emtb::version + (commit.empty() ? "" : " (commit " + commit + ")"));
  const auto socket = std::make_shared<std::string>();
  line.global().option("--socket", *socket,
                       "where the daemon listens [$XDG_RUNTIME_DIR/emtb.sock, or /run/emtb/emtb.sock]");
  const auto answers = std::make_shared<emtb::KeptAnswers>(std::vector<std::string>(argv + 1, argv + argc));
  line.global().flag("--no-cache", answers->off,
                     "works an answer out anew, also where the same was asked before of the same files");
  emtb::add_daemon_commands(line, socket);
  emtb::add_bench_command(line, socket);
  emtb::add_config_command(line);
  emtb::add_latency_command(line, socket);
  emtb::add_replay_command(line);
  emtb::add_devices_command(line);
  emtb::add_profiles_command(line);
  emtb::add_model_commands(line, answers);
  emtb::add_discover_command(line, answers);
  emtb::add_effects_command(line);
  emtb::add_file_commands(line, answers);
  emtb::add_export_commands(line);
  emtb::add_check_command(line, answers);
  emtb::add_batch_command(line);
  emtb::add_estimate_command(line, answers);
  emtb::add_paper_command(line);
  emtb::add_investigate_command(line, socket, argc, argv);
  emtb::add_report_command(line, argc, argv);
  emtb::add_page_command(line, socket, argc, argv);
  group(line);
  return line.run(argc, argv);
}
