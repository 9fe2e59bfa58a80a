#include "analysis/check/between_runs.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "analysis/check/balance.h"
#include "analysis/check/readings.h"
#include "analysis/check/units.h"

namespace emtb {
namespace {

/// What a run says of a constant, where it says it surely.
using Constants = std::vector<std::optional<double>>;

/// How many times the constant of a run is that of the others, where these agree.
/// @param agree factor within which they do
std::optional<double> against_others(const Constants& all, std::size_t run, double agree) {
  std::vector<double> others;
  for (std::size_t r = 0; r < all.size(); ++r) {
    if (r != run && all[r]) others.push_back(*all[r]);
  }
  if (!all[run] || others.empty()) return std::nullopt;
  const auto [low, high] = std::ranges::minmax(others);
  if (high > agree * low) return std::nullopt;
  return *all[run] / std::sqrt(low * high);
}

bool is_off(std::optional<double> ratio, double limit) { return ratio && (*ratio > limit || *ratio < 1 / limit); }

std::string in_unit(Signal signal, double too_large) {
  constexpr double within = 1.3;
  if (signal == Signal::omega || signal == Signal::theta) {
    const auto unit = speed_unit(too_large, within);
    if (unit && signal == Signal::omega) return ", as if it were in " + std::string(unit->unit);
    return unit ? ", as if it were in deg" : "";
  }
  const auto unit = milli_unit(too_large, within);
  return unit ? ", as if it were in " + std::string(unit->unit) : "";
}

/// A signal that alone makes R_a and K_b of a run so many times those of the others.
struct OtherScale {
  Signal signal{};
  double factor = 1;  ///< the signal is so many times as large
};

std::optional<OtherScale> other_scale(std::optional<double> R, std::optional<double> K, const MotionWindows& w) {
  constexpr double both = 1.6;
  // Inductance, a driver that is not measured and brushes bend R_a more than K_b; friction bends K_b without a current.
  const bool R_is_off = is_off(R, 5), K_is_off = is_off(K, w.current ? 2.5 : 4);
  if (R_is_off && K && *R < both * *K && *K < both * *R) return OtherScale{*w.voltage, std::sqrt(*R * *K)};
  if (K_is_off && (!w.current || (R && !is_off(R, both)))) return OtherScale{*w.speed, 1 / *K};
  if (R_is_off && K && !is_off(K, both)) return OtherScale{Signal::i_a, 1 / *R};
  return std::nullopt;
}

/// K_b of a run that is clearly another than that of two others or more, which agree far better.
/// @param of_each what its voltage, current and speed say
DataFindings other_motors(std::span<const Run> runs, std::span<const MotorConstants> of_each) {
  constexpr double precisely = 150;       // of its standard errors; coils, noise and quick runs bend others
  constexpr double clearly = 0.08;        // of it: what effects bend K_b by between runs is less
  constexpr double far_better = 1.0 / 6;  // of that difference
  DataFindings findings;
  Constants K(runs.size());
  for (std::size_t r = 0; r < runs.size(); ++r) {
    if (of_each[r].back_emf.t > precisely) K[r] = of_each[r].back_emf.value;
  }
  if (std::ranges::count_if(K, [](const auto& k) { return k.has_value(); }) < 3) return findings;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const auto ratio = against_others(K, r, HUGE_VAL);
    if (!ratio || std::abs(*ratio - 1) < clearly) continue;
    if (!against_others(K, r, 1 + far_better * std::abs(*ratio - 1))) continue;
    findings.push_back({runs[r].name,
                        {},
                        Flaw::scale,
                        0,
                        runs[r].duration(),
                        "voltage, current and speed give K_b = " + short_number(*K[r]) + " V s/rad here, " +
                            short_number(*K[r] / *ratio) +
                            " in the other runs: is it another motor, or has a signal another scale? Then leave the "
                            "run out, or mend it with --map",
                        false});
  }
  return findings;
}

}  // namespace

DataFindings scales_between_runs(std::span<const Run> runs, std::span<const MotionWindows> windows) {
  if (runs.size() < 2) return {};
  std::vector<MotorConstants> of_each;
  Constants R(runs.size()), K(runs.size());
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const MotionWindows& w = windows[r];
    if (w.voltage != windows[0].voltage || w.speed != windows[0].speed || w.current != windows[0].current) return {};
    const MotorConstants& c = of_each.emplace_back(constants_of(w));
    if (c.resistance.sure()) R[r] = c.resistance.value;
    if (c.back_emf.sure()) K[r] = c.back_emf.value;
  }
  constexpr double alike = 1.6;  // heat, and what a balance without effects is off
  DataFindings findings;
  const bool two = std::ranges::count_if(K, [](const auto& k) { return k.has_value(); }) == 2;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const auto other = other_scale(against_others(R, r, alike), against_others(K, r, alike), windows[r]);
    if (!other) continue;
    const std::string name = name_of(other->signal);
    findings.push_back({runs[r].name, other->signal, Flaw::scale, 0, runs[r].duration(),
                        name + " is " + short_number(other->factor) + " times what the other run" + (two ? "" : "s") +
                            " would make it, by R_a and K_b" + in_unit(other->signal, other->factor) +
                            ": give one of them another scale (--map, unit: or scale:), or leave the run out",
                        true});
    if (two) break;  // the other one says the same of this
  }
  const bool measured = windows[0].voltage == Signal::e_a && windows[0].current;
  return findings.empty() && measured ? other_motors(runs, of_each) : findings;
}

}  // namespace emtb
