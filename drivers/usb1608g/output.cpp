#include "drivers/usb1608g/output.h"

namespace emtb::usb1608g {

void Converter::open(bool again) {
  link_ = std::make_unique<Link>(card_.serial, Access::requests);
  card_.serial = link_->serial();  // whatever else is plugged in later: this one
  const Model& model = link_->model();
  if (channel_ >= model.outputs) {
    throw DeviceError(link_->name() + ": has no analog output " + std::to_string(channel_) +
                      (model.outputs > 0 ? ". It has 0 and 1" : ". Only the -2AO has any"));
  }
  if (!again) {
    configure_fpga(*link_, card_.fpga);
  } else if ((link_->status() & status_bit::fpga_configured) == 0) {
    // Two that load an image at a time would spoil it: the input does.
    throw DeviceError(link_->name() + ": has no FPGA image");
  }
  correction_ = read_calibration(*link_, card_.calibrated).outputs[static_cast<std::size_t>(channel_)];
}

void Converter::write(std::uint32_t code) {
  link_->send(Request::aout, static_cast<std::uint16_t>(code), static_cast<std::uint16_t>(channel_));
}

std::uint32_t Converter::read_back() {
  try {
    return usb1608g::read_back(*link_, channel_);
  } catch (const Stalled& e) {
    throw NoReadBack(e.what());
  }
}

std::string Converter::name() const { return link_->name() + ": output " + std::to_string(channel_); }

}  // namespace emtb::usb1608g
