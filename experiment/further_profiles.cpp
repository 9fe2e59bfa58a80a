#include "experiment/further_profiles.h"

#include <cmath>
#include <numbers>
#include <vector>

#include "hal/error.h"

namespace emtb {
namespace {

constexpr double points_a_period = 40;

}  // namespace

Profile coast_down(std::string name, double level, double rate, double before, double hold, double after, double rest) {
  const double up = before + std::abs(level - rest) / rate;
  return {std::move(name),
          {{0, rest}, {before, rest}, {up, level}, {up + hold, level}, {up + hold, rest}, {up + hold + after, rest}}};
}

Profile reversal(std::string name, double level, int times, double before, double hold, double after, double rest) {
  std::vector<double> levels;
  for (int i = 0; i <= times; ++i) levels.push_back(i % 2 == 0 ? level : -level);
  return staircase(std::move(name), levels, before, hold, after, rest);
}

Profile chirp(std::string name, double offset, double amplitude, double f0, double f1, double before, double total,
              double after, double rest) {
  const double growth = std::log(f1 / f0);
  // φ(t) = 2π ∫ f0 exp(growth t / total) dt
  const auto cycles = [&](double t) {
    return growth == 0 ? f0 * t : f0 * total / growth * std::expm1(growth * t / total);
  };
  const double all = cycles(total);
  if (!(all * points_a_period <= most_levels)) {
    throw ConfigError("profile " + name + ": has " + std::to_string(std::llround(all)) + " periods. Give at most " +
                      std::to_string(std::llround(most_levels / points_a_period)) + ": a lower f1, or a shorter total");
  }
  std::vector<Knot> knots{{0, rest}, {before, rest}, {before, offset}};
  for (double n = 1; n < all * points_a_period; ++n) {
    const double cycle = n / points_a_period;
    const double t = growth == 0 ? cycle / f0 : total / growth * std::log1p(cycle * growth / (f0 * total));
    knots.push_back({before + t, offset + amplitude * std::sin(2 * std::numbers::pi * cycle)});
  }
  const double end = before + total;
  knots.push_back({end, offset + amplitude * std::sin(2 * std::numbers::pi * all)});
  knots.push_back({end, rest});
  knots.push_back({end + after, rest});
  return {std::move(name), std::move(knots)};
}

Profile heat_soak(std::string name, double level, double low, double every, double dip, double before, double total,
                  double after, double rest) {
  if (!(total / every <= most_levels)) throw ConfigError("profile " + name + ": every is too short for total");
  std::vector<Knot> knots{{0, rest}, {before, rest}};
  const double end = before + total;
  double t = before;
  while (t + every + dip <= end) {
    for (const Knot& knot :
         {Knot{t, level}, Knot{t + every, level}, Knot{t + every, low}, Knot{t + every + dip, low}}) {
      knots.push_back(knot);
    }
    t += every + dip;
  }
  for (const Knot& knot : {Knot{t, level}, Knot{end, level}, Knot{end, rest}, Knot{end + after, rest}}) {
    knots.push_back(knot);
  }
  return {std::move(name), std::move(knots)};
}

Profile held(std::string name, std::span<const double> t, std::span<const double> value) {
  std::vector<Knot> knots;
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (i > 0 && value[i] != value[i - 1]) knots.push_back({t[i], value[i - 1]});
    if (i == 0 || value[i] != value[i - 1] || i + 1 == t.size()) knots.push_back({t[i], value[i]});
  }
  return {std::move(name), std::move(knots)};
}

}  // namespace emtb
