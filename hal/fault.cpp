#include "hal/fault.h"

namespace emtb {

std::string_view text(Fault fault) noexcept {
  switch (fault) {
    case Fault::none:
      return "no fault";
    case Fault::over_speed:
      return "over_speed: the speed exceeds limits.omega";
    case Fault::over_current:
      return "over_current: the armature current exceeds limits.i_a";
    case Fault::over_torque:
      return "over_torque: the shaft torque exceeds limits.torque";
    case Fault::run_too_long:
      return "run_too_long: the run lasts longer than limits.time";
    case Fault::field_lost:
      return "field_lost: the field current is below field.min, and a motor without its field runs away";
    case Fault::non_finite:
      return "non_finite: a signal reads NaN or infinity";
    case Fault::stale_signal:
      return "stale_signal: a device has not delivered for too long";
    case Fault::over_range:
      return "over_range: a meter reads more than its range holds";
    case Fault::dead_tacho:
      return "dead_tacho: voltage and current say that the motor turns, the tacho says not";
    case Fault::reversed_tacho:
      return "reversed_tacho: the tacho turns the other way than voltage and current say";
    case Fault::device_lost:
      return "device_lost: an input device does not answer any more";
    case Fault::output_failed:
      return "output_failed: the reference output refused a value";
    case Fault::wrong_function:
      return "wrong_function: a meter is set to measure something else than the bench file says, or holds its display";
    case Fault::device_clock:
      return "device_clock: a device's time stamps run ahead of the computer's clock, or backwards";
    case Fault::samples_lost:
      return "samples_lost: a card's buffer overran, the host took its samples too slowly";
    case Fault::scan_broken:
      return "scan_broken: a card's scan stopped, or came in pieces that cannot be";
    case Fault::overrun:
      return "overrun: the loop missed too many deadlines";
    case Fault::recorder_failed:
      return "recorder_failed: the session cannot be written";
    case Fault::recorder_behind:
      return "recorder_behind: the recorder cannot keep up with the loop";
    case Fault::disk_nearly_full:
      return "disk_nearly_full: the disk with the sessions has hardly any room left";
    case Fault::client_lost:
      return "client_lost: the client that controlled the run is gone";
    case Fault::terminated:
      return "terminated: the process was asked to end";
    case Fault::guardian_lost:
      return "guardian_lost: the process that makes safe when the daemon dies is gone";
  }
  return "unknown fault";
}

}  // namespace emtb
