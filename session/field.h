#pragma once

#include <optional>
#include <string>

#include "session/session.h"

namespace emtb {

/// What an event of code `field` says: `the field has been on for 61.25 s`. To the millisecond.
std::string field_words(double seconds);

/// What it said [s]; nothing: another event, or words of somebody else.
std::optional<double> field_seconds(const Event& event);

}  // namespace emtb
