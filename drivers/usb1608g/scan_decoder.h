#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace emtb::usb1608g {

/// Puts the bytes of a scan together again: transfers end where they like, within a scan or within a sample.
class ScanDecoder {
 public:
  explicit ScanDecoder(std::size_t channels) : codes_(channels) {}

  /// Calls `scan(codes)` for each scan that is complete.
  template <class Take>
  void feed(std::span<const std::uint8_t> bytes, Take scan) {
    for (const std::uint8_t byte : bytes) {
      std::uint16_t& code = codes_[filled_ / 2];
      code = filled_ % 2 == 0 ? byte : static_cast<std::uint16_t>(code | byte << 8U);
      if (++filled_ < 2 * codes_.size()) continue;
      filled_ = 0;
      scan(std::span<const std::uint16_t>(codes_));
    }
  }
  /// Between two scans.
  bool whole() const noexcept { return filled_ == 0; }

 private:
  std::vector<std::uint16_t> codes_;
  std::size_t filled_ = 0;  ///< [bytes]
};

}  // namespace emtb::usb1608g
