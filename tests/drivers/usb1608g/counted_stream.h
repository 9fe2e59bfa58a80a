#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/usb1608g/calibration.h"
#include "hal/input_device.h"

namespace emtb::usb1608g {

/// Samples that count, so that whoever gets them sees whether any is missing or another. The sender waits where the
/// reader is far behind.
class CountedStream {
 public:
  /// @param ahead [samples] that the sender may be ahead of the reader
  CountedStream(std::span<const Signal> signals, std::uint64_t ahead)
      : signals_(signals.begin(), signals.end()), ahead_(ahead), next_(signals.size()) {}

  /// `channels` of the bench file: the signals as volts.
  static std::string channels(std::span<const Signal> signals) {
    std::string text;
    for (std::size_t k = 0; k < signals.size(); ++k) {
      text += (k > 0 ? ", " : "") + std::string(info(signals[k]).name) + ": {channel: " + std::to_string(k) +
              ", range: 10, scale: 1}";
    }
    return text;
  }

  /// Of the sender: fills a transfer. @return false where the reader is too far behind
  bool give(std::span<std::uint8_t> bytes) {
    if (given_ > taken_ + ahead_) return false;
    for (std::size_t at = 0; at + 1 < bytes.size(); at += 2) {
      const std::uint16_t code = code_of(given_++);
      bytes[at] = static_cast<std::uint8_t>(code);
      bytes[at + 1] = static_cast<std::uint8_t>(code >> 8U);
    }
    return true;
  }
  /// Of the reader.
  void take(std::span<const Reading> readings) {
    for (const Reading& reading : readings) {
      std::size_t k = 0;
      while (signals_[k] != reading.signal) ++k;
      const bool in_order = reading.sequence == next_[k];
      const std::uint16_t code = code_of(reading.sequence * signals_.size() + k);
      wrong_ += in_order && reading.value == volts_of(code, {}, 10) ? 0 : 1;
      next_[k] = reading.sequence + 1;
    }
    taken_ += readings.size();
  }
  std::uint64_t taken() const { return taken_; }
  std::uint64_t wrong() const { return wrong_; }  ///< out of order, or of another value

 private:
  /// None of them at an end of the range, where there would be no reading.
  static std::uint16_t code_of(std::uint64_t n) { return static_cast<std::uint16_t>(200 + n % 60'000); }

  std::vector<Signal> signals_;
  std::uint64_t ahead_;
  std::uint64_t given_ = 0;
  std::vector<std::uint64_t> next_;
  std::atomic<std::uint64_t> taken_ = 0;
  std::uint64_t wrong_ = 0;
};

}  // namespace emtb::usb1608g
