#pragma once

#include <array>
#include <boost/lockfree/spsc_queue.hpp>
#include <cstdint>
#include <optional>
#include <string_view>

#include "hal/signal.h"

namespace emtb {

/// How a run ended.
enum class Outcome : std::uint8_t { done, stopped, fault };

enum class LoopState : std::uint8_t { latched, arming, armed, running };

/// As people and clients are told: `latched`.
constexpr std::string_view word(LoopState state) noexcept {
  constexpr std::array<std::string_view, 4> words{"latched", "arming", "armed", "running"};
  return words[static_cast<std::size_t>(state)];
}

/// What the loop tells the recorder.
struct Record {
  enum class Kind : std::uint8_t {
    sample,   ///< a value of a signal, of the run
    glimpse,  ///< one outside of a run: for the black box alone
    event,    ///< a fault or a gap
    field,    ///< a run begins: for how long the field has been on, as `value`
    state,    ///< the loop's state, from now on, as `value`
    end,      ///< the run is over; the last record of each run, always sent
  };

  Kind kind = Kind::sample;
  Outcome outcome = Outcome::done;  ///< of an end
  std::uint16_t code = 0;           ///< of an event or an end: a Fault, or an event_code
  std::optional<Signal> signal{};
  double t = 0;      ///< [s] from the start of the run
  double value = 0;  ///< of the signal; of a gap: how many are missing
  double at = 0;     ///< [s] on the loop's clock
};

/// From the loop's thread to the recorder's: one producer, one consumer, no lock, no allocation after construction.
using Ring = boost::lockfree::spsc_queue<Record>;

}  // namespace emtb
