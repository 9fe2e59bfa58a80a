#pragma once

#include <memory>

#include "drivers/card_output.h"
#include "drivers/usb1608g/card.h"

namespace emtb::usb1608g {

struct OutputSettings {
  CardSettings card;
  int channel = 0;
  Limits limits;          ///< [V] within -10 to 10
  bool read_back = true;  ///< ask the card what it was told
};

/// One analog output of a USB-1608GX-2AO.
class Converter final : public CardConverter {
 public:
  explicit Converter(const OutputSettings& settings) : card_(settings.card), channel_(settings.channel) {}

  /// The first time with an FPGA image, where there is none.
  void open(bool again) override;
  void close() noexcept override { link_.reset(); }
  std::uint32_t code(double volts) const noexcept override { return code_of(volts, correction_); }
  void write(std::uint32_t code) override;
  std::uint32_t read_back() override;
  std::string name() const override;

 private:
  CardSettings card_;
  int channel_;
  std::unique_ptr<Link> link_;
  Correction correction_;
};

}  // namespace emtb::usb1608g
