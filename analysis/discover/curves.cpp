#include "analysis/discover/curves.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <sstream>
#include <string>

namespace emtb {
namespace {

/// May each of the values of a curve of so many pieces be told? Each needs samples about it, a fair part of an even
/// share.
bool reached(const std::vector<double>& x, double range, std::size_t pieces) {
  constexpr double part = 0.1;
  std::vector<double> weight(pieces + 1, 0.0);
  for (const double v : x) {
    const double at = std::abs(v) / range * static_cast<double>(pieces);
    const auto k = std::min(static_cast<std::size_t>(at), pieces - 1);
    weight[k] += 1 - (at - static_cast<double>(k));
    weight[k + 1] += at - static_cast<double>(k);
  }
  const double even = static_cast<double>(x.size()) / static_cast<double>(pieces);
  return std::ranges::all_of(weight.begin() + 1, weight.end() - 1, [&](double w) { return w > part * even; });
}

std::string digits(double value) {
  std::ostringstream text;
  text.precision(5);
  text << value;
  return text.str();
}

std::string unit_of(const std::string& x) { return x == "omega" ? "rad/s" : x == "i_a" ? "A" : "V"; }

/// Which values at the ends of a curve over |x| are told.
struct Ends {
  bool at_zero = false, far = false;
};

/// A curve of `pieces` straight pieces over |x|, odd in x.
FormulaText odd_curve(TermPlace place, const std::string& x, double range, double largest, std::size_t pieces,
                      Ends told) {
  const std::string out = place == TermPlace::torque ? "N m" : "V";
  FormulaText law;
  law.id = std::string(told.at_zero ? "curve_of_" : "curve_from_zero_of_") + std::to_string(pieces) +
           (place == TermPlace::torque ? "_torque_of_" : "_voltage_of_") + x;
  law.place = place;
  law.of = {x};
  law.is_curve = true;
  const double apart = range / static_cast<double>(pieces);
  std::string sum;
  for (std::size_t k = told.at_zero ? 0 : 1; k < pieces + (told.far ? 1 : 0); ++k) {
    const std::string c = "c" + std::to_string(k), size = "abs(" + x + ")";
    law.parameters.push_back({c, out, 0, -largest, largest, true, false});
    const std::string off = k == 0 ? size : "abs(" + size + " - " + digits(static_cast<double>(k) * apart) + ")";
    sum += (sum.empty() ? "" : " + ") + c + "*max(0, 1 - " + off + "/" + digits(apart) + ")";
  }
  law.formula = "-tanh(" + x + "/s)*(" + sum + ")";
  law.parameters.push_back(turning_width("s", unit_of(x), range));
  return law;
}

void add_odd_curves(std::vector<FormulaText>& list, TermPlace place, const std::string& x,
                    const std::vector<double>& values, double largest, bool far = false) {
  const double range = range_of(values);
  if (!(range > 0) || values.empty()) return;
  for (const std::size_t pieces : {4, 6, 8}) {
    if (!reached(values, range, pieces)) continue;
    for (const bool at_zero : {false, true}) {
      list.push_back(odd_curve(place, x, range, largest, pieces, {at_zero, far}));
    }
  }
}

/// The first waves of a turn, together.
/// @param speeds [rad/s] range of those of a friction; absent: of a torque
FormulaText curve_of_angle(std::size_t waves, double largest, std::optional<double> speeds) {
  FormulaText law;
  law.id = "curve_of_" + std::to_string(waves) + (speeds ? "_waves_of_friction_over_angle" : "_waves_of_angle");
  law.place = TermPlace::torque;
  law.of = {"theta"};
  if (speeds) law.of.emplace_back("omega");
  law.is_curve = true;
  std::string sum;
  for (std::size_t n = 1; n <= waves; ++n) {
    const std::string order = std::to_string(n), angle = n == 1 ? "theta" : order + "*theta";
    sum += (n == 1 ? "a" : " + a") + order + "*cos(" + angle + ") + b" + order + "*sin(" + angle + ")";
    for (const char* symbol : {"a", "b"}) {
      law.parameters.push_back({symbol + order, "N m", 0, -largest, largest, true, false});
    }
  }
  law.formula = speeds ? "-tanh(omega/s)*(" + sum + ")" : sum;
  if (speeds) law.parameters.push_back(turning_width("s", "rad/s", *speeds));
  return law;
}

}  // namespace

std::vector<FormulaText> remembering_curves(const Samples& samples, double torque_scale, double, bool voltage) {
  std::vector<FormulaText> list;
  if (voltage || samples.paths.empty()) return list;
  add_odd_curves(list, TermPlace::torque, "omega", samples.omega, largest_law * torque_scale, true);
  for (FormulaText& law : list) {
    law.id = "lagging_" + law.id;
    law.rate = "(" + law.formula + " - z)/tau";
    law.formula = "z";
    law.parameters.push_back(time_to_follow(samples));
  }
  return list;
}

std::vector<FormulaText> curves(const Samples& samples, double torque_scale, double voltage_scale, bool voltage) {
  std::vector<FormulaText> list;
  if (voltage) {
    add_odd_curves(list, TermPlace::voltage, "i_a", samples.i_a, largest_law * voltage_scale);
    add_odd_curves(list, TermPlace::voltage, "omega", samples.omega, largest_law * voltage_scale);
    return list;
  }
  add_odd_curves(list, TermPlace::torque, "omega", samples.omega, largest_law * torque_scale);
  add_odd_curves(list, TermPlace::torque, "i_a", samples.i_a, largest_law * torque_scale);
  add_odd_curves(list, TermPlace::torque, "u_ref", samples.u_ref, largest_law * torque_scale);
  for (const std::size_t waves : {2, 4, 6, 8}) {
    list.push_back(curve_of_angle(waves, largest_law * torque_scale, {}));
    if (turns_both_ways(samples)) {
      list.push_back(curve_of_angle(waves, largest_law * torque_scale, range_of(samples.omega)));
    }
  }
  return list;
}

}  // namespace emtb
