#include "figures/scale.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "figures/number.h"

namespace emtb {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// The step of 1, 2 or 5 times a power of ten that gives about so many ticks.
double nice_step(double width, double about) {
  const double raw = width / std::max(1.0, about);
  const double decade = std::pow(10, std::floor(std::log10(raw)));
  const double factor = raw / decade;
  return decade * (factor < 1.4 ? 1 : factor < 3 ? 2 : factor < 7 ? 5 : 10);
}

std::string fixed(double value, int decimals) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value == 0 ? 0.0 : value);
  return text;
}

std::string power_of_ten(int exponent) {
  if (exponent >= -3 && exponent <= 4) return fixed(std::pow(10, exponent), std::max(0, -exponent));
  return "10" + superscript(exponent);
}

void widen(Range& range, double value) {
  range.low = std::min(range.low, value);
  range.high = std::max(range.high, value);
}

void widen(Range& range, const std::vector<double>& values, bool log) {
  for (const double v : values) {
    if (std::isfinite(v) && (!log || v > 0)) widen(range, v);
  }
}

Range or_else(Range range, Range other) { return range.low <= range.high ? range : other; }

std::vector<Tick> log_ticks(Range range, double about) {
  std::vector<Tick> ticks;
  const auto put = [&](double at) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", at);
    ticks.push_back({at, text});
  };
  if (range.high < 3 * range.low) {  // far less than a decade
    for (const double at : nice_ticks(range, about)) put(at);
    return ticks;
  }
  if (range.high < 10 * range.low) {
    const double decade = std::pow(10, std::floor(std::log10(range.low)));
    for (const double m : {1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0, 60.0, 80.0}) {
      if (m * decade >= range.low && m * decade <= range.high) put(m * decade);
    }
    return ticks;
  }
  const int first = static_cast<int>(std::floor(std::log10(range.low)));
  const int last = static_cast<int>(std::ceil(std::log10(range.high)));
  const double decades = std::log10(range.high / range.low);
  const int every = std::max(1, static_cast<int>(std::ceil(decades / std::max(2.0, about))));
  for (int e = first; e <= last; ++e) {
    for (int m = 1; m <= 9; ++m) {
      const double at = m * std::pow(10, e);
      if (at < range.low * (1 - 1e-9) || at > range.high * (1 + 1e-9)) continue;
      const bool labelled = m == 1 ? (e - first) % every == 0 : decades < 2.2 && (m == 2 || m == 5);
      if (m > 1 && every > 1) continue;
      ticks.push_back({at, !labelled ? "" : m == 1 ? power_of_ten(e) : fixed(at, std::max(0, -e))});
    }
  }
  return ticks;
}

}  // namespace

std::vector<double> nice_ticks(Range range, double about) {
  const double step = nice_step(range.high - range.low, about);
  std::vector<double> ticks;
  const double slack = 1e-9 * (range.high - range.low);
  for (double k = std::ceil((range.low - slack) / step); k * step <= range.high + slack; ++k) ticks.push_back(k * step);
  return ticks;
}

Scale::Scale(const Axis& axis, Range data, double padding, double ticks) : axis_(axis), range_(data) {
  if (!axis.categories.empty()) {
    range_ = {-0.5, static_cast<double>(axis.categories.size()) - 0.5};
    for (std::size_t i = 0; i < axis.categories.size(); ++i)
      ticks_.push_back({static_cast<double>(i), axis.categories[i]});
    return;
  }
  if (axis.with_zero) widen(range_, axis.log ? 1 : 0);
  if (axis.min) range_.low = *axis.min;
  if (axis.max) range_.high = *axis.max;
  if (axis.log) {
    if (range_.high < 1.05 * range_.low) range_ = {range_.low / 2, range_.high * 2};
    const double factor = std::pow(range_.high / range_.low, padding);
    if (!axis.min) range_.low /= factor;
    if (!axis.max) range_.high *= factor;
    ticks_ = log_ticks(range_, ticks);
    return;
  }
  const double size = std::max(std::abs(range_.low), std::abs(range_.high));
  if (range_.high - range_.low <= 1e-9 * size || size == 0) {  // a constant: give it room
    const double room = size > 0 ? 0.1 * size : 1;
    range_ = {range_.low - room, range_.high + room};
  }
  if (padding == 0) {  // an end that is all but on a tick goes there: 29.999 s is 30 s
    for (const double at : nice_ticks({2 * range_.low - range_.high, 2 * range_.high - range_.low}, 3 * ticks)) {
      const double near = 0.005 * (range_.high - range_.low);
      if (!axis.min && at < range_.low && at > range_.low - near) range_.low = at;
      if (!axis.max && at > range_.high && at < range_.high + near) range_.high = at;
    }
  }
  const double room = padding * (range_.high - range_.low);
  const bool on_zero = axis.with_zero && (range_.low == 0 || range_.high == 0);
  if (!axis.min && !(on_zero && range_.low == 0)) range_.low -= room;
  if (!axis.max && !(on_zero && range_.high == 0)) range_.high += room;

  std::vector<double> places = nice_ticks(range_, ticks);
  while (places.size() < 2) places = nice_ticks(range_, ticks += 1);  // one tick says nothing of the size
  const double step = nice_step(range_.high - range_.low, ticks);
  const double largest = std::max(std::abs(range_.low), std::abs(range_.high));
  const bool prefixed = prefix_for(-3, axis.unit).has_value();
  if (largest >= 1e5 || largest < (prefixed ? 0.1 : 1e-2))
    exponent_ = 3 * static_cast<int>(std::floor(std::log10(largest) / 3));
  const double unit = std::pow(10, exponent_);
  const int decimals = std::max(0, -static_cast<int>(std::floor(std::log10(step / unit) + 1e-9)));
  for (const double at : places) {
    const double clean = std::abs(at) < 1e-9 * step ? 0 : at;
    ticks_.push_back({clean, with_minus(fixed(clean / unit, decimals))});
  }
}

double Scale::share(double value) const {
  if (!std::isfinite(value)) return nan;
  if (!axis_.log || !axis_.categories.empty()) return (value - range_.low) / (range_.high - range_.low);
  return value > 0 ? std::log(value / range_.low) / std::log(range_.high / range_.low) : nan;
}

std::string Scale::title() const {
  std::string unit = axis_.unit;
  if (const auto prefix = prefix_for(exponent_, unit)) {
    unit.insert(0, prefix->letter);
  } else if (exponent_ != 0) {
    unit = "10" + superscript(exponent_) + (unit.empty() ? "" : " " + unit);
  }
  return axis_.label + (unit.empty() ? "" : (axis_.label.empty() ? "[" : " [") + unit + "]");
}

Range x_range(const Figure& figure) {
  Range range{infinity, -infinity};
  const bool log = figure.x_axis.log;
  for (const Panel& panel : figure.panels) {
    for (const Trace& t : panel.traces) {
      widen(range, t.x, log);
      widen(range, t.left, log);
      widen(range, t.right, log);
      if (t.kind == Trace::Kind::horizontal_bars && !log) widen(range, 0);
    }
    for (const Reference& r : panel.references)
      if (r.vertical) widen(range, r.at);
    for (const Shade& s : panel.shades) widen(range, {s.from, s.to}, log);
  }
  return or_else(range, log ? Range{1, 10} : Range{0, 1});
}

Range y_range(const Panel& panel) {
  Range range{infinity, -infinity};
  const bool log = panel.y_axis.log;
  for (const Trace& t : panel.traces) {
    widen(range, t.y, log);
    widen(range, t.low, log);
    widen(range, t.high, log);
    if (t.kind == Trace::Kind::bars && !log) widen(range, 0);
  }
  for (const Reference& r : panel.references)
    if (!r.vertical) widen(range, {r.at}, log);
  return or_else(range, log ? Range{1, 10} : Range{0, 1});
}

Pixels thinned(std::span<const double> x, std::span<const double> y) {
  Pixels columns;
  const auto keep = [&](std::size_t i) {
    columns.x.push_back(x[i]);
    columns.y.push_back(y[i]);
  };
  for (std::size_t i = 0; i < x.size();) {
    if (!std::isfinite(x[i]) || !std::isfinite(y[i])) {
      if (!columns.y.empty() && std::isfinite(columns.y.back())) columns.x.push_back(nan), columns.y.push_back(nan);
      ++i;
      continue;
    }
    const double column = std::floor(x[i]);
    std::size_t lowest = i, highest = i, last = i;
    for (std::size_t j = i; j < x.size() && std::isfinite(y[j]) && std::floor(x[j]) == column; ++j) {
      if (y[j] < y[lowest]) lowest = j;
      if (y[j] > y[highest]) highest = j;
      last = j;
    }
    std::vector<std::size_t> chosen{i, lowest, highest, last};
    std::ranges::sort(chosen);
    chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
    for (const std::size_t k : chosen) keep(k);
    i = last + 1;
  }

  // Straight stretches: a point goes where the line from the last one kept to the next passes it by.
  Pixels out;
  std::vector<std::size_t> skipped;  // since the last point kept
  for (std::size_t i = 0; i < columns.x.size(); ++i) {
    const bool inner = i > 0 && i + 1 < columns.x.size() && std::isfinite(columns.y[i]) &&
                       std::isfinite(columns.y[i + 1]) && !out.x.empty() && std::isfinite(out.y.back());
    bool straight = inner && skipped.size() < 64;
    if (straight) {
      skipped.push_back(i);
      const double dx = columns.x[i + 1] - out.x.back(), dy = columns.y[i + 1] - out.y.back();
      const double length = std::hypot(dx, dy);
      straight = std::ranges::all_of(skipped, [&](std::size_t k) {
        const double px = columns.x[k] - out.x.back(), py = columns.y[k] - out.y.back();
        const double along = px * dx + py * dy;
        return along >= 0 && along <= length * length + 1e-12 && std::abs(px * dy - py * dx) <= 0.05 * length;
      });
    }
    if (straight) continue;
    skipped.clear();
    out.x.push_back(columns.x[i]);
    out.y.push_back(columns.y[i]);
  }
  return out;
}

std::string plain(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text.compare(i, 2, "_{") == 0) {
      const std::size_t end = text.find('}', i);
      if (end != std::string::npos) {
        out += "_" + text.substr(i + 2, end - i - 2);
        i = end;
        continue;
      }
    }
    out += text[i];
  }
  return out;
}

}  // namespace emtb
