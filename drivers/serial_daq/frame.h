#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace emtb::serial_daq {

/// How a message travels (docs/serial-daq-protocol.md): message and CRC, stuffed so that no byte of it is 0 (COBS),
/// then a 0. After whatever noise the next 0 is a new beginning.

inline constexpr std::size_t longest_message = 64;  ///< [bytes] without CRC

/// CRC-16/CCITT-FALSE: polynomial 0x1021, from 0xFFFF. Of `123456789`: 0x29B1.
std::uint16_t crc(std::span<const std::uint8_t> bytes) noexcept;

/// The bytes to send. @param message at most longest_message bytes
std::string framed(std::span<const std::uint8_t> message);

/// Finds the messages in what a line gives.
class FrameReader {
 public:
  /// Calls `take(message)` for each that is whole.
  void feed(std::string_view bytes, const std::function<void(std::span<const std::uint8_t>)>& take);
  std::uint64_t broken() const noexcept { return broken_; }  ///< frames that were dropped

 private:
  std::vector<std::uint8_t> frame_;
  bool too_long_ = false;
  bool in_step_ = false;  ///< a 0 was seen: what came before it may be the rest of anything
  std::uint64_t broken_ = 0;
};

}  // namespace emtb::serial_daq
