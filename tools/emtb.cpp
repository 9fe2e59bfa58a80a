#include "emtb/version.h"
#include "tools/commands.h"

int main(int argc, char** argv) {
  emtb::CommandLine line("Runs a DC-motor test bench, and finds out what the model of the motor is missing.",
                         emtb::version);
  const auto socket = std::make_shared<std::string>();
  line.global().option("--socket", *socket,
                       "where the daemon listens [$XDG_RUNTIME_DIR/emtb.sock, or /run/emtb/emtb.sock]");
  emtb::add_daemon_commands(line, socket);
  emtb::add_bench_command(line, socket);
  emtb::add_latency_command(line, socket);
  emtb::add_replay_command(line);
  emtb::add_devices_command(line);
  emtb::add_model_commands(line);
  emtb::add_file_commands(line);
  emtb::add_check_command(line);
  emtb::add_batch_command(line);
  emtb::add_estimate_command(line);
  emtb::add_paper_command(line);
  emtb::add_investigate_command(line, socket, argc, argv);
  emtb::add_report_command(line, argc, argv);
  emtb::add_page_command(line, socket, argc, argv);
  return line.run(argc, argv);
}
