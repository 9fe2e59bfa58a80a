#pragma once

#include <memory>

#include "drivers/card_output.h"
#include "drivers/comedi/link.h"

namespace emtb::comedi {

struct OutputSettings {
  CardSettings card;
  unsigned int channel = 0;
  Limits limits;          ///< [V] the narrowest range of the card that holds them is taken
  bool read_back = true;  ///< ask the card what it was told
};

/// One analog output of a card, in the narrowest of its ranges that will do.
class OutputConverter final : public CardConverter {
 public:
  explicit OutputConverter(const OutputSettings& settings)
      : card_(settings.card), channel_(settings.channel), reach_{settings.limits.min, settings.limits.max} {}

  void open(bool again) override;
  void close() noexcept override { link_.reset(); }
  std::uint32_t code(double volts) const noexcept override { return converter_.code(volts); }
  void write(std::uint32_t code) override { link_->write(subdevice_, channel_, range_, code); }
  std::uint32_t read_back() override;
  std::string name() const override { return link_->name() + ": output " + std::to_string(channel_); }

 private:
  CardSettings card_;
  unsigned int channel_;
  Range reach_;
  std::unique_ptr<Link> link_;
  unsigned int subdevice_ = 0;
  std::size_t range_ = 0;
  Converter converter_;
};

}  // namespace emtb::comedi
