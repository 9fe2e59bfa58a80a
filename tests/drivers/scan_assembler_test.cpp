#include "drivers/scan_assembler.h"

#include <gmock/gmock.h>

#include <random>

namespace emtb {
namespace {

using ::testing::ElementsAre;

/// What an assembler makes of a stream that comes in pieces of random length.
std::vector<std::vector<std::uint32_t>> assembled(std::size_t channels, std::size_t width,
                                                  std::span<const std::uint32_t> codes) {
  std::vector<std::uint8_t> bytes;
  for (const std::uint32_t code : codes) {
    for (std::size_t k = 0; k < width; ++k) bytes.push_back(static_cast<std::uint8_t>(code >> 8 * k));
  }
  ScanAssembler assembler(channels, width);
  std::vector<std::vector<std::uint32_t>> scans;
  std::mt19937 random(5);
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t piece = std::min<std::size_t>(random() % 40, bytes.size() - at);
    const std::size_t foretold = scans.size() + assembler.scans_in(piece);
    assembler.feed(std::span(bytes).subspan(at, piece),
                   [&](std::span<const std::uint32_t> scan) { scans.emplace_back(scan.begin(), scan.end()); });
    EXPECT_EQ(scans.size(), foretold);
    at += piece;
  }
  return scans;
}

TEST(ScanAssemblerTest, IsPutTogetherWhereverReadsEnd) {
  std::vector<std::uint32_t> codes(3 * 1000 + 2);
  std::mt19937 random(7);
  for (const std::size_t width : {2U, 4U}) {
    for (std::uint32_t& code : codes) code = random() & (width == 2 ? 0xFFFFU : 0xFFFFFFU);
    const auto scans = assembled(3, width, codes);
    ASSERT_EQ(scans.size(), 1000U) << "half a scan is none";
    for (std::size_t n = 0; n < scans.size(); ++n) {
      EXPECT_THAT(scans[n], ElementsAre(codes[3 * n], codes[3 * n + 1], codes[3 * n + 2]));
    }
  }
}

}  // namespace
}  // namespace emtb
