#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace emtb {

/// Puts a card's bytes together to scans: packets and reads end where they like, within a scan or within a sample.
class ScanAssembler {
 public:
  /// @param width [bytes] of a sample, lowest byte first: 2 or 4
  ScanAssembler(std::size_t channels, std::size_t width) : codes_(channels), width_(width) {}

  /// Calls `scan(codes)` for each scan that is complete.
  template <class Take>
  void feed(std::span<const std::uint8_t> bytes, Take scan) {
    for (const std::uint8_t byte : bytes) {
      std::uint32_t& code = codes_[sample_];
      code |= static_cast<std::uint32_t>(byte) << 8U * place_;
      if (++place_ < width_) continue;
      place_ = 0;
      if (++sample_ == codes_.size()) {
        sample_ = 0;
        scan(std::span<const std::uint32_t>(codes_));
      }
      codes_[sample_] = 0;
    }
  }
  /// How many scans will have been completed when so many more bytes have come.
  std::size_t scans_in(std::size_t bytes) const noexcept {
    return (sample_ * width_ + place_ + bytes) / (width_ * codes_.size());
  }

 private:
  std::vector<std::uint32_t> codes_;
  std::size_t width_;
  std::size_t sample_ = 0;  ///< which is filled next
  std::size_t place_ = 0;   ///< [bytes] of it that are there
};

}  // namespace emtb
