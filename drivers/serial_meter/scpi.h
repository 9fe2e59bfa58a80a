#pragma once

#include <string>
#include <vector>

#include "drivers/serial_meter/measurement.h"

namespace emtb::serial_meter::scpi {

/// Bench meters that speak SCPI: HP/Agilent 34401A, Keithley 2000.
///
///     READ?    +1.23456789E-01      a new reading; +9.90000000E+37 is an overload
///     FUNC?    "CURR"               the function: "VOLT:AC", "CURR:DC" ...; without a coupling it is DC
///
/// A number does not say what it is of, so each poll asks for the function *after* the reading, and the reading counts
/// only with that answer behind it. Before the first poll, and after each that failed, SYST:ERR?
/// (`+0,"No error"`) sorts the answers to earlier requests from those to come.
/// Source: 34401A user's guide, chapter 4; Keithley 2000 user's manual, section 4.

/// Sorts one line of answer, without its end.
Message classify(std::string_view line) noexcept;

/// A number as these meters write it, `SD.DDDDDDDDESDD`: one digit before the point, two in the exponent, without which
/// a truncated overload would be a reading.
std::optional<Measurement> parse(std::string_view number) noexcept;

Message find(std::string_view received) noexcept;

/// What puts the meter under remote control and into a function and range; none where it has no such function.
/// @param range full scale, in the unit of the function; 0: the meter chooses
/// @param line_cycles of the mains that each reading integrates; 0: as it is set
std::vector<std::string> set_up(const Function& function, double range, double line_cycles);

}  // namespace emtb::serial_meter::scpi
