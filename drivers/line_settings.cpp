#include "drivers/line_settings.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace emtb {

std::optional<LineSettings> read_line(std::string_view text, LineSettings settings) {
  constexpr std::array bauds{600, 1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200};
  constexpr std::string_view parities = "NEO";
  const std::size_t gap = text.find(' ');
  if (gap == std::string_view::npos || gap > 6 || text.size() != gap + 4) return std::nullopt;
  int baud = 0;
  for (const char c : text.substr(0, gap)) {
    if (c < '0' || c > '9') return std::nullopt;
    baud = 10 * baud + (c - '0');
  }
  const char bits = text[gap + 1];
  const std::size_t parity = parities.find(text[gap + 2]);
  const char stop = text[gap + 3];
  const bool known = std::ranges::find(bauds, baud) != bauds.end() && parity != std::string_view::npos;
  if (!known || (bits != '7' && bits != '8') || (stop != '1' && stop != '2')) return std::nullopt;
  settings.baud = baud;
  settings.data_bits = bits - '0';
  settings.parity = std::array{Parity::none, Parity::even, Parity::odd}[parity];
  settings.stop_bits = stop - '0';
  return settings;
}

}  // namespace emtb
