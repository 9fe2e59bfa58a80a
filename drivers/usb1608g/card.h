#pragma once

#include <filesystem>

#include "drivers/usb1608g/calibration.h"
#include "drivers/usb1608g/link.h"
#include "drivers/usb1608g/protocol.h"

namespace emtb::usb1608g {

/// Which card, and what a host must know of it.
struct CardSettings {
  std::string serial;          ///< empty: the only one
  std::filesystem::path fpga;  ///< the vendor's image, for a card that has none yet; empty: there must be one
  bool calibrated = true;      ///< false: nominal scale, whatever the card's memory says
};

/// Gives the card its FPGA image where it has none. The image is the vendor's and no part of emtb.
/// @throws DeviceError where it has none and no file is named, the file is another card's, or the card refuses it
void configure_fpga(Link& link, const std::filesystem::path& image);

/// @throws DeviceError where the card's memory holds what cannot be true
Calibration read_calibration(Link& link, bool calibrated);

/// One sample, without a scan. @return the code @throws Stalled while a scan runs
std::uint16_t read_once(Link& link, const Slot& slot);

/// @return the code that an output was last given @throws Stalled by a card that does not tell
std::uint16_t read_back(Link& link, int channel);

}  // namespace emtb::usb1608g
