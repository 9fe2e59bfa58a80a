#pragma once

#include <memory>
#include <string>

#include "tools/command_line.h"
#include "tools/kept/kept_answers.h"

namespace emtb {

/// Each group of commands adds itself to the command line: one function and one file a group. Those that only read
/// files and say what they find are given the answers of before.

/// status, watch, run, stop, reset, estimates: those that talk to the daemon.
/// @param socket where the daemon listens; empty: where it usually does
void add_daemon_commands(CommandLine& line, const std::shared_ptr<const std::string>& socket);

/// investigate: daemon and diagnosis together. @param argv the command line, for those who repeat it
void add_investigate_command(CommandLine& line, const std::shared_ptr<const std::string>& socket, int argc,
                             const char* const* argv);

/// bench check, calibrate, spin: before anything runs.
void add_bench_command(CommandLine& line, const std::shared_ptr<const std::string>& socket);

/// config check, upgrade, schema: YAML files, without a bench.
void add_config_command(CommandLine& line);

/// latency: whether the computer keeps the bench's rate.
void add_latency_command(CommandLine& line, const std::shared_ptr<const std::string>& socket);

/// replay: a recorded session through the daemon's loop, in a daemon of its own.
void add_replay_command(CommandLine& line);

/// calibrate, compare, diagnose, add: a model beside sessions.
void add_model_commands(CommandLine& line, const std::shared_ptr<const KeptAnswers>& answers);

/// discover, trend: what the library leaves, and whether it is the same machine.
void add_discover_command(CommandLine& line, const std::shared_ptr<const KeptAnswers>& answers);

/// effects: what a model can include.
void add_effects_command(CommandLine& line);

/// simulate, import, export, info, table: files without a fit.
void add_file_commands(CommandLine& line, const std::shared_ptr<const KeptAnswers>& answers);

/// export-model, gains: a model for other programs, and a controller for it.
void add_export_commands(CommandLine& line);

/// check: whether recordings are what they say.
void add_check_command(CommandLine& line, const std::shared_ptr<const KeptAnswers>& answers);

/// batch: many motors, on many cores and machines.
void add_batch_command(CommandLine& line);

/// estimate: the paper's static experiments on recorded sessions.
void add_estimate_command(CommandLine& line, const std::shared_ptr<const KeptAnswers>& answers);

/// paper: the paper's experiments on the simulated bench, beside its numbers.
void add_paper_command(CommandLine& line);

/// report: the diagnosis as a page. @param argv the command line, for those who repeat it
void add_report_command(CommandLine& line, int argc, const char* const* argv);

/// page: the page in a browser, of the bench, of files, or of both. @param argv the command line, for reports
void add_page_command(CommandLine& line, const std::shared_ptr<const std::string>& socket, int argc,
                      const char* const* argv);

/// profiles: the experiments that come with emtb.
void add_profiles_command(CommandLine& line);

/// devices: what is connected to this machine.
void add_devices_command(CommandLine& line);

}  // namespace emtb
