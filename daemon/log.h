#pragma once

namespace emtb {

/// From now on spdlog writes to standard error, in UTC, one printable line each, and never waits there: what a terminal
/// that was stopped (Ctrl-S) or a pipe that nobody reads does not take is dropped, and how many lines were is said when
/// it takes some again. Who waits for a reader of its log does not see a signal to end, nor a guardian that died.
void log_to_standard_error();

}  // namespace emtb
