#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/card_input.h"
#include "drivers/usb1608g/card.h"

namespace emtb::usb1608g {

/// A signal on one of the card's inputs.
struct InputChannel {
  Signal signal{};
  Slot slot;
  double scale = 1;   ///< reading = scale * volts + offset, SI
  double offset = 0;  ///< SI
};

struct InputSettings {
  CardSettings card;
  std::vector<InputChannel> channels;  ///< 1 to 16, in the order of the scan
  double rate = 1000;                  ///< [Hz] scans that are asked for
  double latency = 0.002;              ///< [s] that samples may wait in the card to come together
  Pacer pacer = Pacer::scan;
  int start_length = 15;  ///< [bytes] of the request that starts a scan, 14 or 15
};

/// The inputs of a USB-1608G, as CardInput drives them.
///
/// An overrun, a stall, a scan that stops and one that comes in pieces of scans break the scan. A card that is
/// unplugged or loses its FPGA image has gone.
class Inputs final : public ScannedInputs {
 public:
  explicit Inputs(InputSettings settings);

  /// Gives the card its FPGA image, where it has none, and reads each channel once.
  void open() override;
  void close() noexcept override { link_.reset(); }
  std::vector<Channel> describe(const std::string& name) const override;
  void run(Scan& scan) override;

 private:
  std::optional<double> volts(std::size_t channel, std::uint32_t code) const noexcept;
  /// Of a scan from which nothing comes. @return why, or none where it is well after all
  Fault diagnose();

  InputSettings settings_;
  std::uint32_t pacer_period_;
  double period_;  ///< [s] between scans, as the card makes them
  std::unique_ptr<Link> link_;
  Calibration calibration_;
  MonotonicClock machine_;
};

}  // namespace emtb::usb1608g
