#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "hal/signal.h"

namespace emtb {

/// From a unit that people use to the signal's own: SI value = scale * value + offset.
struct UnitConversion {
  double scale = 1;
  double offset = 0;
};

/// @param unit as people write it: `rpm`, `1/min`, `deg`, `mA`, `N cm`, `degF`; case matters only where it must (mV,
/// MV)
/// @return nothing where the unit is not one of this signal
std::optional<UnitConversion> unit_of(Signal signal, std::string_view unit);

/// The same unit as known_units() writes it; empty where it is none of the signal.
std::string_view unit_named(Signal signal, std::string_view unit);

/// [s] that one unit of time is: `ms`, `us`, `min`, `h`.
std::optional<double> time_unit(std::string_view unit);

/// The units that unit_of() knows for a signal, for messages: `rad/s, rpm, 1/min, deg/s, rev/s`.
std::string known_units(Signal signal);

}  // namespace emtb
