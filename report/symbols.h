#pragma once

#include <string>

#include "hal/signal.h"

namespace emtb {

/// Names and units as a page prints them (figures/figure.h: `_{..}` is a subscript).

std::string symbol_of(Signal signal);                 ///< `ω`, `i_{a}`
std::string compared_symbol(Signal signal);           ///< the same, but `Δθ`: an angle is compared by its steps
std::string symbol_of(const std::string& parameter);  ///< `R_a` as `R_{a}`, `tacho_lag.tau` as `τ (tacho_lag)`
std::string printed_unit(std::string_view unit);      ///< `kg m2` as `kg m²`, `ohm` as `Ω`

/// `steps.csv#a@1:3` of `/data/steps.csv#a@1:3`.
std::string short_name(const std::string& run);

/// A name that a file may have: letters, digits, dots, - and _ stay, anything between becomes one _.
std::string file_name(const std::string& text);

}  // namespace emtb
