#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/serial_meter/measurement.h"
#include "drivers/serial_port.h"

namespace emtb::serial_meter {

/// How a family of meters talks.
struct Protocol {
  std::string_view name;
  Find find;
  /// What one reading takes to ask for, each answered by one message; none: the meter talks by itself.
  std::span<const std::string_view> requests;
  std::string_view clear = {};  ///< drops whatever the meter is at; empty: it has no such thing
  bool prompts = false;         ///< a prompt follows each answer and each command
  /// A request that is answered by a prompt, once all before it is done; empty: none is needed. Answers carry no
  /// number: after a silence, only what comes behind this one is known to be new.
  std::string_view barrier = {};
  /// The lines that set function and range; null: the meter is set by hand.
  std::function<std::vector<std::string>(const Function&, double range, double line_cycles)> set_up = nullptr;
};

/// One range of one quantity, DC.
struct Range {
  Quantity quantity;
  double full_scale;  ///< in the unit of the quantity
  double digit;       ///< the last digit, in the same unit
};

/// A meter by its name in bench files.
struct Model {
  std::string_view name;   ///< `metex_m4650cr`
  std::string_view maker;  ///< for people: `Metex M-4650CR`
  const Protocol* protocol;
  LineSettings line;              ///< as it leaves the factory
  double period = 0.4;            ///< [s] between readings
  double window = 0.4;            ///< [s] that a reading averages; where the maker does not say, all of the period
  double line_cycles = 0;         ///< of the mains, that we set it to integrate; 0: it cannot be set
  std::span<const Range> ranges;  ///< as far as known
};

std::span<const Model> models() noexcept;

/// @return nullptr where there is none of that name
const Model* model_named(std::string_view name) noexcept;

}  // namespace emtb::serial_meter
