#include "drivers/comedi/output.h"

namespace emtb::comedi {

void OutputConverter::open(bool /*again*/) {
  link_ = std::make_unique<Link>(card_);
  subdevice_ = link_->subdevice(COMEDI_SUBD_AO, "analog output");
  range_ = link_->range_for(subdevice_, channel_, reach_);
  converter_ = link_->converter(subdevice_, channel_, range_);
}

std::uint32_t OutputConverter::read_back() {
  try {
    return link_->read(subdevice_, channel_, range_, Wiring::single_ended);
  } catch (const Gone&) {
    throw;
  } catch (const DeviceError& e) {
    throw NoReadBack(e.what());
  }
}

}  // namespace emtb::comedi
