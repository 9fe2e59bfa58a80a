#include "drivers/comedi/mapping.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <sstream>

namespace emtb::comedi {

static_assert(std::endian::native == std::endian::little, "a command's samples come in the machine's own order");

std::optional<std::size_t> narrowest(std::span<const Range> ranges, Range wanted) noexcept {
  constexpr double rounding = 1e-9;  // [V] range tables are of float microvolts
  std::optional<std::size_t> best;
  for (std::size_t k = 0; k < ranges.size(); ++k) {
    if (ranges[k].min > wanted.min + rounding || ranges[k].max < wanted.max - rounding) continue;
    if (!best || ranges[k].max - ranges[k].min < ranges[*best].max - ranges[*best].min) best = k;
  }
  return best;
}

std::string in_words(std::span<const Range> ranges) {
  std::ostringstream text;
  for (const Range& range : ranges) text << (&range == ranges.data() ? "" : ", ") << range.min << " to " << range.max;
  return text.str();
}

unsigned int pack(unsigned int channel, std::size_t range, Wiring wiring) noexcept {
  const unsigned int reference = wiring == Wiring::differential ? AREF_DIFF
                                 : wiring == Wiring::common     ? AREF_COMMON
                                                                : AREF_GROUND;
  return CR_PACK(channel, static_cast<unsigned int>(range), reference);
}

double Converter::volts(lsampl_t code) const noexcept { return comedi_to_physical(code, &to_volts); }

lsampl_t Converter::code(double volts) const noexcept {
  // The library rounds, but wraps what is below 0 and does not know the highest code.
  double sum = 0;
  double power = 1;
  for (unsigned k = 0; k <= to_code.order; ++k) {
    sum += to_code.coefficients[k] * power;
    power *= volts - to_code.expansion_origin;
  }
  return static_cast<lsampl_t>(std::lround(std::clamp(sum, 0.0, static_cast<double>(top))));
}

Converter nominal(Range range, lsampl_t top) noexcept {
  Converter converter;
  converter.top = top;
  converter.unipolar = range.min >= 0;
  const double step = (range.max - range.min) / static_cast<double>(top);
  converter.to_volts.order = converter.to_code.order = 1;
  converter.to_volts.coefficients[0] = range.min;
  converter.to_volts.coefficients[1] = step;
  converter.to_code.expansion_origin = range.min;
  converter.to_code.coefficients[1] = 1 / step;
  return converter;
}

std::optional<double> scan_period(const comedi_cmd& command, std::size_t count) noexcept {
  constexpr double nanosecond = 1e-9;  // [s]
  if (command.scan_begin_src == TRIG_TIMER) return nanosecond * command.scan_begin_arg;
  // A card with one clock only: each scan follows the one before it.
  if (command.convert_src == TRIG_TIMER) return nanosecond * command.convert_arg * static_cast<double>(count);
  return std::nullopt;
}

}  // namespace emtb::comedi
