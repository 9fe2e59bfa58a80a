#pragma once

#include <optional>
#include <string_view>

namespace emtb {

enum class Parity { none, even, odd };

/// How a serial line is set, as one would write it: `2400 8N1`, and what DTR and RTS are at. The opto couplers of
/// handheld meters draw their power from these two: the wrong way round, the meter is silent.
struct LineSettings {
  int baud = 9600;  ///< 600 to 115200, the usual steps
  int data_bits = 8;
  Parity parity = Parity::none;
  int stop_bits = 1;
  bool dtr = true;
  bool rts = true;

  /// [s] that so many bytes take: each has a start bit, too.
  double wire_time(std::size_t bytes) const noexcept {
    const int bits = 1 + data_bits + (parity == Parity::none ? 0 : 1) + stop_bits;
    return static_cast<double>(bits) * static_cast<double>(bytes) / baud;
  }
};

/// Reads `9600 7E2` over what is there already; DTR and RTS stay. @return nothing where it is no such text
std::optional<LineSettings> read_line(std::string_view text, LineSettings settings);

}  // namespace emtb
