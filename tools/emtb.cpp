#include "daemon/version.h"
#include "tools/commands.h"

int main(int argc, char** argv) {
  emtb::CommandLine line("Runs a DC-motor test bench, and finds out what the model of the motor is missing.",
                         emtb::version);
  emtb::add_daemon_commands(line);
  emtb::add_devices_command(line);
  emtb::add_model_commands(line);
  emtb::add_file_commands(line);
  emtb::add_estimate_command(line);
  emtb::add_paper_command(line);
  emtb::add_report_command(line, argc, argv);
  return line.run(argc, argv);
}
