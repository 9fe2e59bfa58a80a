#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "drivers/card_input.h"
#include "drivers/serial_daq/frame.h"
#include "drivers/serial_daq/message.h"
#include "drivers/usb1608g/calibration.h"
#include "drivers/usb1608g/protocol.h"
#include "tests/fuzz/targets.h"

namespace emtb::fuzz {
namespace {

std::span<const std::uint8_t> as_bytes(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

class TickingClock final : public Clock {
 public:
  double now() const noexcept override { return now_ += 1e-4; }
  void sleep_until(double) noexcept override {}

 private:
  mutable double now_ = 1;
};

}  // namespace

void serial_daq(std::string_view bytes) {
  using namespace emtb::serial_daq;
  FrameReader reader;
  for (std::size_t at = 0; at < bytes.size(); at += 7) {  // as a port delivers them: in pieces
    reader.feed(bytes.substr(at, 7), [](std::span<const std::uint8_t> message) {
      must(message.size() <= longest_message, "a message is no longer than the protocol allows");
      must(framed(message).size() <= longest_message + 4, "and so is its frame");
      if (const auto hello = read_hello(message)) {
        must(std::ranges::all_of(hello->name, [](char c) { return c >= ' ' && c < 0x7f; }), "a name can be shown");
      }
      read_sample(message);
    });
  }
  read_hello(as_bytes(bytes));
  read_sample(as_bytes(bytes));
}

/// What the card's memory says of its calibration, then a scan in pieces: all of a card's bytes that are looked into.
void usb1608g(std::string_view text) {
  using namespace emtb::usb1608g;
  const auto bytes = as_bytes(text);
  const std::size_t table = std::min(bytes.size(), Calibration::input_bytes);
  std::array<Correction, 4> corrections;
  for (std::size_t n = 0; n < corrections.size(); ++n) {
    if (const auto read = correction(bytes.first(table), n)) corrections[n] = *read;
    must(std::isfinite(corrections[n].slope) && std::isfinite(corrections[n].offset), "a correction is finite");
  }
  const auto scan = bytes.subspan(table);
  const std::size_t count = scan.empty() ? 1 : 1 + scan[0] % 3U;
  std::vector<Channel> channels;
  for (std::size_t n = 0; n < count; ++n) {
    channels.push_back({.signal = static_cast<Signal>(n + 1), .period = 1e-3, .source = "card"});
  }
  Handover handover(channels);
  handover.restart();
  const TickingClock clock;
  ClockReport report;
  const std::atomic<bool> quit = false;
  Scan taken(channels, 2, handover, clock, report, quit);
  std::array<Reading, 64> readings;
  std::array<double, signal_count> last{};
  for (std::size_t at = 0; at < scan.size();) {
    const std::size_t piece = std::min<std::size_t>(1 + scan[at] % 61U, scan.size() - at);
    taken.take(scan.subspan(at, piece), [&](std::size_t channel, std::uint32_t code) -> std::optional<double> {
      const auto word = static_cast<std::uint16_t>(code);
      if (saturated(word)) return std::nullopt;
      return volts_of(word, corrections[channel], ranges[channel % ranges.size()]);
    });
    at += piece;
    const Readings got = handover.take(readings);
    must(got.count <= readings.size(), "no more readings than there is room for");
    for (const Reading& reading : std::span(readings).first(got.count)) {
      must(std::isfinite(reading.value) && std::abs(reading.value) < 30, "a voltage of the card is one");
      must(reading.time > last[index(reading.signal)], "time increases");
      last[index(reading.signal)] = reading.time;
    }
  }
  const double wish = text.empty() ? 0.0 : static_cast<double>(bytes[0]) - 128;
  must(std::isfinite(volts_of(code_of(wish, corrections[0]), corrections[0], 10)), "any wish has a code");
}

}  // namespace emtb::fuzz
