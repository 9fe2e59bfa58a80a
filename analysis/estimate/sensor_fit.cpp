#include "analysis/estimate/sensor_fit.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "analysis/numerics/moments.h"
#include "hal/error.h"

namespace emtb {
namespace {

constexpr double told_apart = 10;  // standard errors, and steps of the converter: by hand, 10 % of the scale at worst

std::string in_words(double value) {
  std::ostringstream text;
  text.precision(4);
  text << value;
  return text.str();
}

template <class Of>
double span_of(std::span<const SensorPoint> points, Of of) {
  const auto [low, high] = std::ranges::minmax(points, {}, of);
  return of(high) - of(low);
}

}  // namespace

SensorFit fit_sensor(std::span<const SensorPoint> points, double lsb, double share) {
  if (points.size() < 2)
    throw SessionError("a calibration needs two points at least, far apart; three show a residual");
  const double values = span_of(points, [](const SensorPoint& p) { return p.value; });
  if (values == 0) throw SessionError("all references are the same. Give two at least, far apart");
  const double raws = span_of(points, [](const SensorPoint& p) { return p.raw; });
  const double scatter = std::ranges::max(points, {}, &SensorPoint::scatter).scatter;
  if (raws <= told_apart * std::max(scatter, lsb)) {
    throw SessionError("the sensor reads the same at all references, within " + in_words(raws) +
                       " at the input. Is it wired, and to this channel? Then take references further apart");
  }

  const Moments m = moments_of(
      points.size(), [&](std::size_t k) { return points[k].raw; }, [&](std::size_t k) { return points[k].value; });
  SensorFit fit{.scale = m.slope(), .offset = m.intercept()};
  double squares = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const double off = std::abs(fit.scale * points[k].raw + fit.offset - points[k].value);
    squares += off * off;
    if (off > fit.worst) {
      fit.worst = off;
      fit.worst_at = k;
    }
  }
  if (points.size() > 2) fit.residual = std::sqrt(squares / static_cast<double>(points.size() - 2));
  if (points.size() > 2 && fit.worst > share * values) {
    throw SessionError("point " + std::to_string(fit.worst_at + 1) + " (" + in_words(points[fit.worst_at].value) +
                       ") is " + in_words(fit.worst) + " off the line, more than " + in_words(100 * share) +
                       " % of the span: mistyped, not settled, or a sensor that is not straight");
  }
  return fit;
}

}  // namespace emtb
