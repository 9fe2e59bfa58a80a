#pragma once

#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "drivers/handover.h"
#include "drivers/modbus_meter/link.h"
#include "drivers/modbus_meter/value.h"
#include "drivers/settings.h"
#include "drivers/wake.h"
#include "hal/clock.h"
#include "hal/input_device.h"

namespace emtb::modbus_meter {

/// Where a signal lies in the meter, and what its number means.
struct Register {
  Signal signal{};
  int function = 4;  ///< 3 (holding registers) or 4 (input registers)
  int address = 0;   ///< from 0, as it is sent
  Type type = Type::u16;
  Order order;
  Scaling scaling;
  std::optional<double> overload;  ///< the number by which the meter says that its range is exceeded
  double window = 0;               ///< [s] that a reading averages
};

struct MeterSettings {
  Address address;
  int unit = 1;
  std::vector<Register> registers;
  double period = 0.2;   ///< [s] between readings
  double timeout = 0.5;  ///< [s] until an answer counts as missing
  double latency = 0;    ///< [s] from the end of a window until the register holds its mean
};

/// A Modbus meter, asked in a thread of its own.
///
/// A reading bears the middle between question and answer, less the latency. A register that the meter does not have is
/// Fault::wrong_function, its overload Fault::over_range, NaN Fault::non_finite, a vanished port or connection
/// Fault::device_lost. Each stands until all registers read well; what has vanished is opened again as soon as it is
/// back. Silence and a wrong checksum give no reading: what is missing for too long, the loop notices.
///
/// On a serial line an answer does not say to which question. After each failure the line therefore rests for four
/// timeouts, and what came meanwhile is forgotten: an answer later than that would be taken for a new one.
class Meter final : public InputDevice {
 public:
  /// @param clock whose time the readings bear
  /// @throws DeviceError where the meter cannot be reached, does not answer or does not have a register
  Meter(std::string name, std::shared_ptr<Clock> clock, MeterSettings settings);
  Meter(const Meter&) = delete;
  Meter& operator=(const Meter&) = delete;
  ~Meter() override;

  std::span<const Channel> channels() const noexcept override { return descriptions_; }
  void start() override { handover_.restart(); }
  Readings read(std::span<Reading> out) noexcept override { return handover_.take(out); }

 private:
  void run(std::unique_ptr<Link> link) noexcept;
  void poll(Link& link);
  /// @param fault set where the answer says that something is wrong
  Outcome ask(Link& link, const Register& entry, Fault& fault);
  void recover(Link& link) const;
  void try_each_register(Link& link);

  std::string name_;
  std::shared_ptr<Clock> clock_;
  MeterSettings settings_;
  std::vector<Channel> descriptions_;
  Handover handover_;
  MonotonicClock machine_;
  Wake quit_;
  std::thread thread_;
};

}  // namespace emtb::modbus_meter
