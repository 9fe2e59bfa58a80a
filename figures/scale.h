#pragma once

#include <span>
#include <string>
#include <vector>

#include "figures/figure.h"

namespace emtb {

/// From where to where an axis goes.
struct Range {
  double low = 0, high = 1;
};

/// A tick mark; those between the decades of a logarithmic axis have no label.
struct Tick {
  double at = 0;
  std::string label;
};

/// An axis with its range, its ticks and the way from values to pixels.
class Scale {
 public:
  /// @param data    what it must hold, where the axis does not say
  /// @param padding share of the range to leave free at each end that the axis does not fix
  /// @param ticks   how many ticks there is room for, about
  Scale(const Axis& axis, Range data, double padding, double ticks);

  /// Where a value is: 0 at the low end, 1 at the high one. NaN where it has no place.
  double share(double value) const;

  const Range& range() const { return range_; }
  const std::vector<Tick>& ticks() const { return ticks_; }

  /// The axis in words: `ω [rad/s]`, with the power of ten that the ticks leave out: `i_{a} [mA]`, `J [10⁻³ kg m²]`.
  std::string title() const;

 private:
  Axis axis_;
  Range range_;
  std::vector<Tick> ticks_;
  int exponent_ = 0;  ///< ticks are labelled in units of 10^exponent
};

/// Multiples of 1, 2 or 5 times a power of ten within a range, `about` as many.
std::vector<double> nice_ticks(Range range, double about);

/// The smallest range that holds all finite values (all positive ones, where `log`) of a figure's panel.
Range x_range(const Figure& figure);
Range y_range(const Panel& panel);

/// A curve as a screen shows it, in pixels.
struct Pixels {
  std::vector<double> x, y;
};

/// Thins a curve to the first, lowest, highest and last point of each pixel column, then leaves out points that lie on
/// the straight line between their neighbours (within a twentieth of a pixel). NaN breaks the curve, and stays.
Pixels thinned(std::span<const double> x, std::span<const double> y);

/// `i_{a}` without the marks: `i_a`.
std::string plain(const std::string& text);

}  // namespace emtb
