#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/card_input.h"
#include "drivers/comedi/link.h"

namespace emtb::comedi {

/// A signal on one of the card's inputs: reading = scale · volts + offset.
struct InputChannel {
  Signal signal{};
  unsigned int channel = 0;
  Wiring wiring = Wiring::single_ended;
  Range wanted{.min = -10, .max = 10};  ///< [V] the narrowest range of the card that holds it is taken
  double scale = 1;                     ///< [the signal's unit per V]
  double offset = 0;
};

struct InputSettings {
  CardSettings card;
  std::vector<InputChannel> channels;  ///< in the order of the scan
  double rate = 1000;                  ///< [Hz] scans that are asked for
};

/// The inputs of a card by comedi, as CardInput drives them: a command that runs without end.
///
/// A buffer that overran, and a command that ends or falls silent, break the scan.
class Inputs final : public ScannedInputs {
 public:
  explicit Inputs(InputSettings settings) : settings_(std::move(settings)) {}

  /// Chooses ranges, has the card check the command, and reads each channel once.
  /// @throws DeviceError where it has no such channel or range, or cannot scan at the rate
  void open() override;
  void close() noexcept override { link_.reset(); }
  std::vector<Channel> describe(const std::string& name) const override;
  std::size_t width() const noexcept override { return plan_.width; }
  void run(Scan& scan) override;

 private:
  /// What the card is told.
  struct Plan {
    unsigned int subdevice = 0;
    std::size_t width = 2;           ///< [bytes] of a sample
    std::vector<unsigned int> list;  ///< channels, packed
    std::vector<Range> ranges;
    std::vector<Converter> converters;
    comedi_cmd command{};  ///< its list is set where it is used
    double period = 0;     ///< [s] that the card makes of it
  };

  Plan plan() const;
  std::optional<double> volts(std::size_t channel, std::uint32_t code) const noexcept;

  InputSettings settings_;
  std::unique_ptr<Link> link_;
  Plan plan_;
  MonotonicClock machine_;
};

}  // namespace emtb::comedi
