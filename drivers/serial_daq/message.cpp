#include "drivers/serial_daq/message.h"

namespace emtb::serial_daq {
namespace {

constexpr std::size_t shortest_hello = 8;
constexpr std::size_t sample_size = 20;

std::uint16_t word(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8U);
}

std::uint32_t long_word(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  return word(bytes, at) | static_cast<std::uint32_t>(word(bytes, at + 2)) << 16U;
}

}  // namespace

std::optional<Hello> read_hello(std::span<const std::uint8_t> message) {
  if (message.size() < shortest_hello || message[0] != 'H') return std::nullopt;
  Hello hello{.version = message[1],
              .pwm_top = word(message, 2),
              .analog_top = word(message, 4),
              .watchdog_ms = word(message, 6),
              .name = {}};
  for (const std::uint8_t letter : message.subspan(shortest_hello)) {
    if (letter >= ' ' && letter < 0x7F) hello.name.push_back(static_cast<char>(letter));
  }
  return hello;
}

std::optional<Sample> read_sample(std::span<const std::uint8_t> message) noexcept {
  if (message.size() != sample_size || message[0] != 'D') return std::nullopt;
  Sample sample{.number = word(message, 1),
                .watchdog = (message[3] & 1U) != 0,
                .duty = static_cast<std::int16_t>(word(message, 4)),
                .counts = long_word(message, 6),
                .micros = long_word(message, 10)};
  for (std::size_t k = 0; k < analog_inputs; ++k) sample.analog[k] = word(message, 14 + 2 * k);
  return sample;
}

std::vector<std::uint8_t> ask_hello() { return {'h'}; }

std::vector<std::uint8_t> ask_samples(std::uint32_t period_us) {
  std::vector<std::uint8_t> message{'s'};
  for (unsigned shift = 0; shift < 32; shift += 8) message.push_back(static_cast<std::uint8_t>(period_us >> shift));
  return message;
}

std::vector<std::uint8_t> set_duty(std::int16_t duty) {
  const auto bits = static_cast<std::uint16_t>(duty);
  return {'p', static_cast<std::uint8_t>(bits), static_cast<std::uint8_t>(bits >> 8U)};
}

}  // namespace emtb::serial_daq
