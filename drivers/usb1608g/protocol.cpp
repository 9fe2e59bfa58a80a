#include "drivers/usb1608g/protocol.h"

#include <algorithm>
#include <cmath>

namespace emtb::usb1608g {
namespace {

constexpr std::size_t image_1 = 73829;  // [bytes] hardware revision 1
constexpr std::size_t image_2 = 73722;  // [bytes] hardware revision 2
constexpr std::array known{
    Model{0x0110, "USB-1608G", 1, 250e3, 0, image_1},      Model{0x0111, "USB-1608GX", 1, 500e3, 0, image_1},
    Model{0x0112, "USB-1608GX-2AO", 1, 500e3, 2, image_1}, Model{0x0134, "USB-1608G", 2, 250e3, 0, image_2},
    Model{0x0135, "USB-1608GX", 2, 500e3, 0, image_2},     Model{0x0136, "USB-1608GX-2AO", 2, 500e3, 2, image_2},
};

constexpr std::size_t sample_bytes = 2;
constexpr std::size_t most_samples = 256;        // a packet
constexpr std::size_t longest_transfer = 16384;  // [bytes]

void append(std::vector<std::uint8_t>& bytes, std::uint32_t number) {
  for (unsigned shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<std::uint8_t>(number >> shift));
}

}  // namespace

std::span<const Model> models() noexcept { return known; }

const Model* model_of(std::uint16_t product_id) noexcept {
  const auto found = std::ranges::find(known, product_id, &Model::product_id);
  return found == known.end() ? nullptr : &*found;
}

std::optional<int> range_of(double volts) noexcept {
  const auto found = std::ranges::find(ranges, volts);
  if (found == ranges.end()) return std::nullopt;
  return static_cast<int>(found - ranges.begin());
}

std::array<std::uint8_t, slots> scan_list(std::span<const Slot> list) noexcept {
  constexpr unsigned last = 0x80;
  std::array<std::uint8_t, slots> bytes{};
  for (std::size_t k = 0; k < std::min(list.size(), slots); ++k) {
    const Slot& slot = list[k];
    const unsigned mode = slot.wiring == Wiring::differential ? 0U : slot.channel < 8 ? 1U : 2U;
    const unsigned end = k + 1 == list.size() ? last : 0U;
    bytes[k] = static_cast<std::uint8_t>((static_cast<unsigned>(slot.channel) & 7U) |
                                         static_cast<unsigned>(slot.range) << 3U | mode << 5U | end);
  }
  return bytes;
}

std::vector<std::uint8_t> scan_start(const ScanStart& start) {
  std::vector<std::uint8_t> bytes;
  append(bytes, 0);  // scans: until stopped
  append(bytes, 0);  // scans a trigger: there is none
  append(bytes, start.period);
  bytes.push_back(static_cast<std::uint8_t>(start.packet - 1));
  bytes.push_back(0);  // options: no burst, no trigger
  bytes.resize(static_cast<std::size_t>(start.length), 0);
  return bytes;
}

std::uint32_t pacer_period(double rate, std::size_t channels, Pacer pacer) noexcept {
  const double ticks = pacer_clock / (pacer == Pacer::scan ? rate : rate * static_cast<double>(channels));
  return static_cast<std::uint32_t>(std::clamp(std::round(ticks) - 1, 1.0, 4294967295.0));  // 0: a clock from outside
}

double scan_rate(std::uint32_t period, std::size_t channels, Pacer pacer) noexcept {
  const double rate = pacer_clock / (static_cast<double>(period) + 1);
  return pacer == Pacer::scan ? rate : rate / static_cast<double>(channels);
}

Packing pack(double rate, std::size_t channels, double latency, std::size_t max_packet) noexcept {
  const std::size_t scan = sample_bytes * channels;
  const auto scans = static_cast<std::size_t>(std::max(1.0, std::floor(rate * latency)));
  if (scans * scan <= max_packet && scans * channels <= most_samples) {
    return {.packet = static_cast<int>(scans * channels), .transfer = max_packet, .whole_scans = true};
  }
  const std::size_t packets = std::clamp<std::size_t>(scans * scan / max_packet, 1, longest_transfer / max_packet);
  return {
      .packet = static_cast<int>(max_packet / sample_bytes), .transfer = packets * max_packet, .whole_scans = false};
}

}  // namespace emtb::usb1608g
