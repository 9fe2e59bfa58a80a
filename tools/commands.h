#pragma once

#include "tools/command_line.h"

namespace emtb {

/// Each group of commands adds itself to the command line: one function and one file a group.

/// status, watch, run, stop, reset, estimates: those that talk to the daemon.
void add_daemon_commands(CommandLine& line);

/// calibrate, compare, diagnose, add: a model beside sessions.
void add_model_commands(CommandLine& line);

/// effects, simulate, import, export, info, estimate, table: files without a fit.
void add_file_commands(CommandLine& line);

}  // namespace emtb
