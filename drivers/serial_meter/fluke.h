#pragma once

#include <string>
#include <vector>

#include "drivers/serial_meter/measurement.h"

namespace emtb::serial_meter::fluke {

/// Fluke 45 and 8808A: after every command line the meter sends a prompt, and takes nothing before.
///
///     MEAS1?   +1.2345E+0 ADC       a new reading with its unit, for we set FORMAT 2; +1E+9 is an overload
///              =>                   done; `?>` the command, `!>` its execution was refused
///
/// Source: Fluke 45 users manual, chapter 5; libsigrok, src/hardware/fluke-45.

/// Sorts one line of answer, without its end.
Message classify(std::string_view line) noexcept;

/// A number as these meters write it, one digit before the point and one in the exponent, and its unit, if any.
std::optional<Measurement> parse(std::string_view line) noexcept;

Message find(std::string_view received) noexcept;

/// What puts the meter under remote control and into a function, 2.5 readings a second; none where it has no such
/// function. The range stays as it was set by hand.
std::vector<std::string> set_up(const Function& function);

}  // namespace emtb::serial_meter::fluke
