#include "drivers/serial_daq/frame.h"

#include <optional>

namespace emtb::serial_daq {
namespace {

constexpr std::size_t crc_bytes = 2;
constexpr std::size_t longest_frame = longest_message + crc_bytes + 1;  // stuffing adds a byte to each 254

/// @return nothing where the frame cannot be one
std::optional<std::vector<std::uint8_t>> unstuffed(std::span<const std::uint8_t> frame) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t at = 0; at < frame.size();) {
    const std::size_t block = frame[at];  // so far to the next 0
    if (block == 0 || at + block > frame.size()) return std::nullopt;
    bytes.insert(bytes.end(), frame.begin() + static_cast<std::ptrdiff_t>(at + 1),
                 frame.begin() + static_cast<std::ptrdiff_t>(at + block));
    at += block;
    if (at < frame.size()) bytes.push_back(0);
  }
  return bytes;
}

}  // namespace

std::uint16_t crc(std::span<const std::uint8_t> bytes) noexcept {
  unsigned sum = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    sum ^= static_cast<unsigned>(byte) << 8U;
    for (int bit = 0; bit < 8; ++bit) sum = (sum & 0x8000U) != 0 ? (sum << 1U) ^ 0x1021U : sum << 1U;
  }
  return static_cast<std::uint16_t>(sum);
}

std::string framed(std::span<const std::uint8_t> message) {
  std::vector<std::uint8_t> bytes(message.begin(), message.end());
  const unsigned sum = crc(message);
  bytes.push_back(static_cast<std::uint8_t>(sum));
  bytes.push_back(static_cast<std::uint8_t>(sum >> 8U));
  std::string frame(1, '\1');
  std::size_t mark = 0;
  for (const std::uint8_t byte : bytes) {
    if (byte == 0) {
      mark = frame.size();
      frame.push_back('\1');
    } else {
      frame.push_back(static_cast<char>(byte));
      ++frame[mark];
    }
  }
  return frame + '\0';
}

void FrameReader::feed(std::string_view bytes, const std::function<void(std::span<const std::uint8_t>)>& take) {
  for (const char c : bytes) {
    if (c != '\0') {
      too_long_ = too_long_ || frame_.size() == longest_frame;
      if (!too_long_) frame_.push_back(static_cast<std::uint8_t>(c));
      continue;
    }
    if (!frame_.empty()) {
      const auto message = too_long_ ? std::nullopt : unstuffed(frame_);
      const bool whole = message && message->size() > crc_bytes &&
                         framed(std::span(*message).first(message->size() - crc_bytes)).size() == frame_.size() + 1 &&
                         crc(std::span(*message).first(message->size() - crc_bytes)) ==
                             ((*message)[message->size() - 2] | (*message)[message->size() - 1] << 8U);
      if (whole) {
        take(std::span(*message).first(message->size() - crc_bytes));
      } else if (in_step_) {
        ++broken_;
      }
    }
    frame_.clear();
    too_long_ = false;
    in_step_ = true;
  }
}

}  // namespace emtb::serial_daq
