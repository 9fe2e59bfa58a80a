#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "server/client.h"

namespace emtb {

/// Ctrl-C becomes a wish that the command obeys in its own time. The second one ends the process: the daemon then sees
/// its client gone.
void catch_interrupt();
bool interrupted();

/// Asks whoever sits at the terminal whether the motor may move. @param yes `--yes`: he has said so already
/// @return the answer. @throws Error where nobody can be asked
bool motor_may_move(const std::string& question, bool yes);

/// The same of anything else. @param about for the error: `whether ...`
bool a_person_agrees(const std::string& question, const std::string& about, bool yes);

/// `omega 102.3 rad/s  i_a 0.41 A` of what the daemon tells of its signals.
std::string signals_in_words(const nlohmann::json& signals);

/// `step_high 3.2/19.0 s` of what the daemon tells of a run.
std::string run_in_words(const nlohmann::json& run);

/// Runs an experiment on the bench and waits for its end, with a progress bar; Ctrl-C stops it.
/// @param wish the parameters of the daemon's `run`; the client must have subscribed
/// @return what the daemon says of its end: session, outcome, fault
/// @throws rpc::Refusal where the daemon refuses; ProtocolError where it is gone.
nlohmann::json run_on_bench(Client& daemon, const nlohmann::json& wish);

/// Of a run that did not end as planned: the fault in words, or `stopped`. @param ended what run_on_bench() returned
std::string why_it_ended(const nlohmann::json& ended);

}  // namespace emtb
