#pragma once

#include <string>
#include <vector>

#include "analysis/discover/discover.h"
#include "analysis/discover/trends.h"

namespace emtb {

/// `torque`, `voltage` or `factor`
std::string name_of(TermPlace place);

/// The unit of a quantity that a law is drawn over: `rad/s` of `omega`.
std::string unit_over(const std::string& of);

/// Where what is left lives, one quantity at a time: `Of the missing torque, 0.0012 N m rms, a smooth function of the
/// speed alone explains 58 to 66 %; 12 % nothing but it explains.`
std::vector<std::string> shares_in_words(const Discovery& discovery);

/// Why there is no law, in a sentence.
std::string no_law_in_words(const Discovery& discovery);

/// What a law may be in a machine, by its shape; empty: nobody knows.
std::string may_be(const FormulaText& law);

/// The law with its values and errors, what confirms it, what it is like, with what it is tied.
std::vector<std::string> law_in_words(const Law& law);

/// `B is 4 % higher in step_high: ...`, `J falls by a third from ramp on: ...`, and the torques that acted for a while.
std::vector<std::string> machine_in_words(const Discovery& discovery);

/// What the runs say as they are, beside what they say without the disturbances; empty: there is none.
std::string with_and_without(const Discovery& discovery);

/// The speeds, currents ... at which the law is least sure, as an experiment; empty: there is no law.
std::string next_for_discovery(const Discovery& discovery);

/// All of it in a paragraph or two: what a diagnosis says where it ends without a name.
std::string discovery_text(const Discovery& discovery);

/// `from one to the next 0.012 +- 0.004 ohm (95 %): a trend, 8 % in all`
std::string in_words(const Trend& trend);

}  // namespace emtb
