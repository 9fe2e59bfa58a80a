#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace emtb::serial_daq {

/// What host and board say to each other (docs/serial-daq-protocol.md). Numbers lie lowest byte first.

inline constexpr int protocol_version = 1;
inline constexpr std::size_t analog_inputs = 3;

/// `H`: the board, after its start and when it is asked.
struct Hello {
  int version = 0;
  std::uint16_t pwm_top = 0;      ///< duty 1
  std::uint16_t analog_top = 0;   ///< the code of the full analog range
  std::uint16_t watchdog_ms = 0;  ///< of silence, after which the board drops the PWM
  std::string name;
};

/// `D`: one sample.
struct Sample {
  std::uint16_t number = 0;  ///< of the sample since the scan began, modulo 65536
  bool watchdog = false;     ///< the board has dropped the PWM because the host was silent
  std::int16_t duty = 0;     ///< as it stands at the pins, -pwm_top to pwm_top
  std::uint32_t counts = 0;  ///< of the encoder, modulo 2^32
  std::uint32_t micros = 0;  ///< [us] of the board's clock at that count, modulo 2^32
  std::array<std::uint16_t, analog_inputs> analog{};
};

std::optional<Hello> read_hello(std::span<const std::uint8_t> message);
std::optional<Sample> read_sample(std::span<const std::uint8_t> message) noexcept;

std::vector<std::uint8_t> ask_hello();
std::vector<std::uint8_t> ask_samples(std::uint32_t period_us);  ///< 0: no more
std::vector<std::uint8_t> set_duty(std::int16_t duty);

}  // namespace emtb::serial_daq
