#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace emtb {

/// Why the loop dropped the reference to its safe value, by number. Numbers never change their meaning.
///
/// 1xx a limit of the bench, 2xx a signal, 3xx a device, 4xx the loop, 5xx the recorder, 6xx a client, 7xx the process.
enum class Fault : std::uint16_t {
  none = 0,
  over_speed = 101,
  over_current = 102,
  over_torque = 103,
  run_too_long = 104,
  field_lost = 105,        ///< nothing proves the field: the motor may run away
  non_finite = 201,        ///< a signal reads NaN or infinity
  stale_signal = 202,      ///< a device has not delivered for too long
  over_range = 203,        ///< a meter reads more than its range holds
  dead_tacho = 204,        ///< voltage and current say that the motor turns, the tacho says not
  reversed_tacho = 205,    ///< the tacho says that the motor turns the other way
  device_lost = 301,       ///< an input device does not answer any more
  output_failed = 302,     ///< the reference output refused a value
  wrong_function = 303,    ///< a meter measures something else than the bench file says
  device_clock = 304,      ///< a device's time stamps run ahead of ours, or backwards
  samples_lost = 305,      ///< a card's buffer overran: the host took its samples too slowly
  scan_broken = 306,       ///< a card's scan stopped, or came in pieces that cannot be
  overrun = 401,           ///< the loop missed too many deadlines
  recorder_failed = 501,   ///< the session cannot be written
  recorder_behind = 502,   ///< the ring to the recorder is full
  disk_nearly_full = 503,  ///< the session still ends well, the next one might not
  client_lost = 601,       ///< the client that controls the run is gone
  terminated = 701,        ///< the process was asked to end
  guardian_lost = 702,     ///< the process that makes safe after our death is gone
};

/// Every fault but none, by number.
inline constexpr std::array all_faults{
    Fault::over_speed,  Fault::over_current,  Fault::over_torque,     Fault::run_too_long,    Fault::field_lost,
    Fault::non_finite,  Fault::stale_signal,  Fault::over_range,      Fault::dead_tacho,      Fault::reversed_tacho,
    Fault::device_lost, Fault::output_failed, Fault::wrong_function,  Fault::device_clock,    Fault::samples_lost,
    Fault::scan_broken, Fault::overrun,       Fault::recorder_failed, Fault::recorder_behind, Fault::disk_nearly_full,
    Fault::client_lost, Fault::terminated,    Fault::guardian_lost};

/// What the fault means, for a person: `over_speed: the speed exceeds limits.omega`.
std::string_view text(Fault fault) noexcept;

}  // namespace emtb
