#pragma once

#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <thread>

#include "drivers/doorbell.h"
#include "drivers/usb1608g/card.h"
#include "hal/analog_output.h"
#include "hal/clock.h"

namespace emtb::usb1608g {

struct OutputSettings {
  CardSettings card;
  int channel = 0;
  Limits limits;          ///< [V] within -10 to 10
  bool read_back = true;  ///< ask the card what it was told
};

/// One analog output of a USB-1608GX-2AO, in a thread of its own and beside whoever scans the inputs.
///
/// The card keeps its last voltage when the host dies, so it is made safe when it is opened and when it is closed, and
/// `emtbd --safe` does just that. Four times a second the card is asked what it was told. A request that fails or
/// takes longer than 0.2 s, and an output that reads back otherwise, are Fault::output_failed, until one is well again.
class Output final : public AnalogOutput {
 public:
  /// The output is safe, and reads back so, when this returns.
  /// @throws DeviceError where the card is absent, has no output, or does not do as it is told
  Output(std::string name, OutputSettings settings);
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;
  ~Output() override;

  Fault set(double volts) noexcept override;
  Fault make_safe() noexcept override;
  Limits limits() const noexcept override { return settings_.limits; }

 private:
  void open();  ///< in the constructor with an FPGA image, where there is none
  void write(double volts);
  void check();
  void run() noexcept;
  Fault verdict() const noexcept;

  std::string name_;
  OutputSettings settings_;
  MonotonicClock machine_;

  // Of the thread.
  std::unique_ptr<Link> link_;
  Correction correction_;
  std::uint16_t written_ = 0;

  static constexpr double never = std::numeric_limits<double>::infinity();
  std::atomic<double> wanted_;              ///< [V] within the limits
  std::atomic<bool> anew_ = false;          ///< even if it is what was written last
  std::atomic<Fault> fault_ = Fault::none;  ///< of the last request
  std::atomic<double> busy_since_ = never;  ///< [s] a request is under way
  std::atomic<bool> quit_ = false;
  Doorbell bell_;
  std::thread thread_;
};

}  // namespace emtb::usb1608g
