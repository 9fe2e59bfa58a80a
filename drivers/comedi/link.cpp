#include "drivers/comedi/link.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <system_error>

namespace emtb::comedi {
namespace {

std::string reason(int error) { return std::generic_category().message(error); }

/// Why a node cannot be opened, and what to do. The library says no more than `No such device`.
std::string why_not(const std::string& node) {
  const int file = ::open(node.c_str(), O_RDWR | O_CLOEXEC);
  const int error = errno;
  if (file >= 0) {
    ::close(file);
    return "is no comedi device. Name the card's node: ls /dev/comedi*";
  }
  switch (error) {
    case ENOENT:
      return "is not there: no kernel driver has found the card. Load the card's own (modprobe adv_pci1710, ni_pcimio "
             "...; lspci -k names it), then: ls /dev/comedi*";
    case ENXIO:
    case ENODEV:
      return "has no card behind it. Load its kernel driver (modprobe adv_pci1710, ni_pcimio ...), or attach the card "
             "with comedi_config";
    case EACCES:
    case EPERM:
      return "may not be opened. Add the user of emtbd to the group iocard";
    default:
      return "cannot be opened: " + reason(error);
  }
}

}  // namespace

Link::Link(const CardSettings& settings) {
  comedi_loglevel(0);  // the library writes to standard error else
  card_.reset(comedi_open(settings.node.c_str()));
  if (!card_) throw DeviceError(settings.node + ": " + why_not(settings.node));
  const char* const board = comedi_get_board_name(card_.get());
  board_ = board != nullptr ? board : "";
  name_ = settings.node + " (" + board_ + ")";
  if (!settings.board.empty() && settings.board != board_) {
    throw DeviceError(name_ + ": the bench file expects a " + settings.board +
                      ". Name another node, or write what this one is");
  }
  fcntl(descriptor(), F_SETFD, FD_CLOEXEC);
  read_calibration(settings.calibration);
}

void Link::read_calibration(const std::string& wish) {
  nominal_ = wish == "nominal";
  if (nominal_) return;
  std::string file = wish;
  if (wish == "auto") {
    const std::unique_ptr<char, decltype(&std::free)> usual(comedi_get_default_calibration_path(card_.get()),
                                                            &std::free);
    std::error_code absent;
    if (!usual || !std::filesystem::exists(usual.get(), absent)) return;
    file = usual.get();
  }
  calibration_.reset(comedi_parse_calibration_file(file.c_str()));
  if (!calibration_) {
    throw DeviceError(name_ + ": calibration " + file +
                      " cannot be read. Make it anew with comedi_calibrate or comedi_soft_calibrate, or write "
                      "calibration: nominal");
  }
}

unsigned int Link::subdevice(int type, const char* what) const {
  const int found = comedi_find_subdevice_by_type(card_.get(), type, 0);
  if (found < 0) throw DeviceError(name_ + ": has no " + what);
  return static_cast<unsigned int>(found);
}

unsigned int Link::flags(unsigned int subdevice) const noexcept {
  const int flags = comedi_get_subdevice_flags(card_.get(), subdevice);
  return flags < 0 ? 0 : static_cast<unsigned int>(flags);
}

Range Link::range(unsigned int subdevice, unsigned int channel, std::size_t number) const {
  const comedi_range* const found =
      comedi_get_range(card_.get(), subdevice, channel, static_cast<unsigned int>(number));
  if (found == nullptr) fail("its ranges");
  if (found->unit != UNIT_volt) return {};  // a current loop, or whatever a jumper says: no volts, so nothing fits
  return {.min = found->min, .max = found->max};
}

std::vector<Range> Link::ranges(unsigned int subdevice, unsigned int channel) const {
  std::vector<Range> all;
  const int count = comedi_get_n_ranges(card_.get(), subdevice, channel);
  for (int k = 0; k < count; ++k) all.push_back(range(subdevice, channel, static_cast<std::size_t>(k)));
  return all;
}

std::size_t Link::range_for(unsigned int subdevice, unsigned int channel, Range wanted) const {
  const int count = comedi_get_n_channels(card_.get(), subdevice);
  if (static_cast<int>(channel) >= count) {
    throw DeviceError(name_ + ": has no channel " + std::to_string(channel) + " there, only 0 to " +
                      std::to_string(count - 1));
  }
  const std::vector<Range> all = ranges(subdevice, channel);
  const auto chosen = narrowest(all, wanted);
  if (!chosen) {
    throw DeviceError(name_ + ": no range of channel " + std::to_string(channel) + " holds " +
                      in_words(std::array{wanted}) + " V. It has " + in_words(all) + " V");
  }
  return *chosen;
}

Converter Link::converter(unsigned int subdevice, unsigned int channel, std::size_t number) const {
  const lsampl_t top = comedi_get_maxdata(card_.get(), subdevice, channel);
  if (top == 0) fail("its resolution");
  Converter converter = comedi::nominal(range(subdevice, channel, number), top);
  if (nominal_) return converter;
  const auto chosen = static_cast<unsigned int>(number);
  Converter calibrated = converter;
  bool well = false;
  if ((flags(subdevice) & SDF_SOFT_CALIBRATED) != 0) {
    well = calibration_ &&
           comedi_get_softcal_converter(subdevice, channel, chosen, COMEDI_TO_PHYSICAL, calibration_.get(),
                                        &calibrated.to_volts) == 0 &&
           comedi_get_softcal_converter(subdevice, channel, chosen, COMEDI_FROM_PHYSICAL, calibration_.get(),
                                        &calibrated.to_code) == 0;
  } else if (calibration_) {  // small converters on the card pull it straight; then the nominal line is true
    if (comedi_apply_parsed_calibration(card_.get(), subdevice, channel, chosen, AREF_GROUND, calibration_.get()) < 0) {
      fail("its calibration");
    }
  }
  return well ? calibrated : converter;
}

lsampl_t Link::read(unsigned int subdevice, unsigned int channel, std::size_t range, Wiring wiring) const {
  const unsigned int reference = CR_AREF(pack(channel, range, wiring));
  lsampl_t code = 0;
  if (comedi_data_read(card_.get(), subdevice, channel, static_cast<unsigned int>(range), reference, &code) < 0) {
    fail("reading channel " + std::to_string(channel));
  }
  return code;
}

void Link::write(unsigned int subdevice, unsigned int channel, std::size_t range, lsampl_t code) const {
  if (comedi_data_write(card_.get(), subdevice, channel, static_cast<unsigned int>(range), AREF_GROUND, code) < 0) {
    fail("writing output " + std::to_string(channel));
  }
}

void Link::fail(const std::string& what) const {
  const int error = comedi_errno();
  if (error == ENODEV || error == ENXIO) throw Gone(name_ + ": has gone");
  if (error == EBUSY) throw DeviceError(name_ + ": " + what + ": another program uses it. Close that one");
  throw DeviceError(name_ + ": " + what + ": " + comedi_strerror(error));
}

}  // namespace emtb::comedi
