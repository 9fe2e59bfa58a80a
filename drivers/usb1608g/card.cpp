#include "drivers/usb1608g/card.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>

namespace emtb::usb1608g {
namespace {

std::vector<std::uint8_t> read_image(const Link& link, const std::filesystem::path& path) {
  const Model& model = link.model();
  if (path.empty()) {
    throw DeviceError(link.name() +
                      ": has no FPGA image since it was switched on. Write fpga: with the path of the vendor's "
                      "image for hardware revision " +
                      std::to_string(model.revision) + ", " + std::to_string(model.fpga_image) +
                      " bytes (it comes with the vendor's software, not with emtb)");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw DeviceError(link.name() + ": FPGA image " + path.string() + ": cannot be read. See fpga: in the bench file");
  std::vector<std::uint8_t> image{std::istreambuf_iterator<char>(file), {}};
  if (image.size() != model.fpga_image) {
    throw DeviceError(link.name() + ": FPGA image " + path.string() + " has " + std::to_string(image.size()) +
                      " bytes, but hardware revision " + std::to_string(model.revision) + " takes one of " +
                      std::to_string(model.fpga_image) + ". Give the image of this card");
  }
  return image;
}

std::vector<std::uint8_t> read_memory(Link& link, std::uint16_t address, std::size_t bytes) {
  const std::array<std::uint8_t, 2> where{static_cast<std::uint8_t>(address), static_cast<std::uint8_t>(address >> 8U)};
  link.send(Request::memory_address, 0, 0, where);
  std::vector<std::uint8_t> table(bytes);
  table.resize(link.receive(Request::memory, table));
  return table;
}

template <std::size_t count>
void read_table(Link& link, std::uint16_t address, std::array<Correction, count>& into, std::string_view what) {
  const std::vector<std::uint8_t> table = read_memory(link, address, 8 * count);
  for (std::size_t n = 0; n < count; ++n) {
    const auto read = correction(table, n);
    if (!read) {
      throw DeviceError(link.name() + ": its memory holds no calibration of " + std::string(what) + " " +
                        std::to_string(n) +
                        " that can be true. Have it calibrated, or write calibration: nominal and "
                        "allow for some 0.5 % of full scale");
    }
    into[n] = *read;
  }
}

}  // namespace

void configure_fpga(Link& link, const std::filesystem::path& path) {
  if ((link.status() & status_bit::fpga_configured) != 0) return;
  const std::vector<std::uint8_t> image = read_image(link, path);
  link.send(Request::fpga_unlock, 0, 0, std::array{fpga_key});
  if ((link.status() & status_bit::fpga_configuring) == 0) {
    throw DeviceError(link.name() + ": does not open for an FPGA image. Unplug it and plug it in again");
  }
  for (std::size_t at = 0; at < image.size(); at += fpga_piece) {
    link.send(Request::fpga_data, 0, 0, std::span(image).subspan(at, std::min(fpga_piece, image.size() - at)));
  }
  if ((link.status() & status_bit::fpga_configured) == 0) {
    throw DeviceError(link.name() + ": does not take the FPGA image " + path.string() +
                      ". Give the image of this card");
  }
  read_once(link, {});  // the first sample after a fresh image is garbage
}

Calibration read_calibration(Link& link, bool calibrated) {
  Calibration calibration;
  if (!calibrated) return calibration;
  read_table(link, Calibration::input_address, calibration.inputs, "input range");
  if (link.model().outputs > 0) read_table(link, Calibration::output_address, calibration.outputs, "output");
  return calibration;
}

std::uint16_t read_once(Link& link, const Slot& slot) {
  link.send(Request::scan_list, 0, 0, scan_list(std::array{slot}));
  std::array<std::uint8_t, 2> code{};
  if (link.receive(Request::ain, code) != code.size()) throw DeviceError(link.name() + ": half a sample");
  return little_endian(code[0], code[1]);
}

std::uint16_t read_back(Link& link, int channel) {
  std::array<std::uint8_t, 8> words{};  // the drivers disagree whether two come or four
  const std::size_t got = link.receive(Request::aout, words);
  const std::size_t at = 2 * static_cast<std::size_t>(channel);
  if (got < at + 2) throw Stalled(link.name() + ": does not tell output " + std::to_string(channel));
  return little_endian(words[at], words[at + 1]);
}

}  // namespace emtb::usb1608g
