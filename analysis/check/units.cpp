#include "analysis/check/units.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

namespace emtb {
namespace {

constexpr double pi = std::numbers::pi;

bool near(double a, double b, double within) { return a > b / within && a < b * within; }

std::optional<UnitFactor> found(std::span<const UnitFactor> known, double factor, double within) {
  const auto nearest = std::ranges::min_element(
      known, {}, [&](const UnitFactor& u) { return std::abs(std::log(u.factor / std::max(factor, 1e-300))); });
  return near(factor, nearest->factor, within) ? std::optional(*nearest) : std::nullopt;
}

}  // namespace

std::optional<UnitSlip> unit_slip(double angle_over_speed) {
  constexpr std::array<UnitSlip, 10> known{{{180 / pi, "deg", true},
                                            {pi / 180, "deg/s", false},
                                            {pi / 30, "rpm", false},
                                            {30 / pi, "rad/s, scaled as if it were rpm", false},
                                            {2 * pi, "rev/s", false},
                                            {1 / (2 * pi), "turns", true},
                                            {1000, "mrad", true},
                                            {1e-3, "mrad/s", false},
                                            {60, "rad/s, divided by 60", false},
                                            {1.0 / 60, "rad/min", false}}};
  for (const UnitSlip& slip : known) {
    if (near(angle_over_speed, slip.factor, 1.08)) return slip;
  }
  return std::nullopt;
}

std::optional<UnitFactor> speed_unit(double too_large, double within) {
  constexpr std::array<UnitFactor, 8> known{{{30 / pi, "rpm"},
                                             {180 / pi, "deg/s"},
                                             {1000, "mrad/s"},
                                             {pi / 30, "rad/s, scaled as if it were rpm"},
                                             {1 / (2 * pi), "rev/s"},
                                             {pi / 180, "rad/s, scaled as if it were deg/s"},
                                             {60, "rad/min"},
                                             {1e-3, "krad/s"}}};
  return found(known, too_large, within);
}

std::optional<UnitFactor> milli_unit(double too_large, double within) {
  constexpr std::array<UnitFactor, 2> known{{{1000, "thousandths (mA, mV, mN m)"}, {1e-3, "thousands"}}};
  return found(known, too_large, within);
}

}  // namespace emtb
