/// Hides laws that the grammar does not hold exactly, splines over the speed, on the simulated servo, and counts what
/// `discover` makes of them; then healthy benches, a changed parameter, and a disturbance: docs/discover.md.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "analysis/discover/discover.h"
#include "config/formula_effect.h"
#include "hal/error.h"
#include "tests/blind/draw.h"
#include "tests/blind/recording.h"

namespace emtb::blind {
namespace {

/// A smooth curve through random values at seven even speeds, odd in the speed: Catmull and Rom's spline.
class HiddenCurve {
 public:
  HiddenCurve(Draw draw, double range, double size) : range_(range) {
    for (double& v : value_) v = size * draw.within(0, 1);
    value_[0] = 0;
  }

  double operator()(double omega) const {
    const double at = std::min(std::abs(omega) / range_, 0.999) * (count - 1);
    const auto k = static_cast<std::size_t>(at);
    const double s = at - static_cast<double>(k);
    const double before = value_[k > 0 ? k - 1 : 0], here = value_[k], next = value_[k + 1],
                 after = value_[std::min(k + 2, count - 1)];
    const double v =
        here +
        0.5 * s *
            (next - before + s * (2 * before - 5 * here + 4 * next - after + s * (3 * (here - next) + after - before)));
    return std::copysign(v, omega);
  }

 private:
  static constexpr std::size_t count = 7;
  std::array<double, count> value_{};
  double range_;
};

Discovery asked(const Bench& bench, std::span<const Run> train, std::uint64_t seed) {
  DiscoverOptions options;
  options.read = [](const FormulaText& t) { return read_formula(YamlMap::parse(t.yaml(), "a law"), t.id); };
  return discover(train, record(bench, bench.held_out, seed + 100), bench.model, options);
}

/// RMS of the found curve less the hidden one, a straight line through zero aside, which is B's, over the hidden span.
double curve_error(const Law& law, const HiddenCurve& hidden) {
  if (law.text.of.front() != "omega" || law.text.place != TermPlace::torque) return 1;
  double xy = 0, xx = 0, low = 0, high = 0;
  std::vector<double> off;
  for (std::size_t k = 0; k < law.at.size(); ++k) {
    const double truth = -hidden(law.at[k]);
    off.push_back(law.value[k] - truth);
    xy += law.at[k] * off.back();
    xx += law.at[k] * law.at[k];
    low = std::min(low, truth);
    high = std::max(high, truth);
  }
  double squares = 0;
  for (std::size_t k = 0; k < off.size(); ++k) squares += std::pow(off[k] - xy / xx * law.at[k], 2);
  return std::sqrt(squares / static_cast<double>(off.size())) / (high - low);
}

/// `17 of 20 (64 to 95 %)`: Wilson's interval at 95 %.
std::string of(std::size_t hits, std::size_t all) {
  if (all == 0) return "0 of 0";
  const double n = static_cast<double>(all), p = static_cast<double>(hits) / n, z = 1.96;
  const double middle = (p + z * z / (2 * n)) / (1 + z * z / n);
  const double half = z / (1 + z * z / n) * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  const auto percent = [](double x) { return std::to_string(std::lround(100 * std::clamp(x, 0.0, 1.0))); };
  return std::to_string(hits) + " of " + std::to_string(all) + " (" + percent(middle - half) + " to " +
         percent(middle + half) + " %)";
}

double excess(double error) { return std::max(0.0, error * error - 1); }

void judge_laws(std::size_t count, std::uint64_t seed) {
  std::size_t offered = 0, shaped = 0;
  std::vector<double> removed;
  for (std::size_t i = 0; i < count; ++i) {
    Draw draw(seed + 1000 * i);
    Bench bench = fast_bench();
    const HiddenCurve curve(draw, 450, draw.log_within(0.01, 0.04));
    bench.plant.hidden_torque = [curve](double omega, double, double) { return curve(omega); };
    const Discovery d = asked(bench, record(bench, bench.train, seed + i), seed + i);
    double gone = 0, wrong = 1;
    if (d.law) {
      ++offered;
      gone = 1 - excess(d.law->held_out_after) / excess(d.law->held_out_before);
      wrong = curve_error(*d.law, curve);
      shaped += wrong < 0.1 ? 1 : 0;
    }
    removed.push_back(gone);
    std::cout << "law " << i << ": held-out " << d.held_out << (d.law ? " -> " : "")
              << (d.law ? std::to_string(d.law->held_out_after) + " by " + d.law->text.formula : " no law")
              << ", ceiling " << d.torque.ceiling << ", removed " << gone << ", curve off by " << wrong << "\n"
              << std::flush;
  }
  std::ranges::sort(removed);
  std::cout << "a law offered: " << of(offered, count) << "; shape right: " << of(shaped, count)
            << "; excess removed on held-out runs, median: " << (removed.empty() ? 0 : removed[count / 2]) << "\n";
}

void judge_healthy(std::size_t count, std::uint64_t seed) {
  std::size_t laws = 0, changed = 0, disturbed = 0;
  for (std::size_t i = 0; i < count; ++i) {
    Draw draw(seed + 1000 * i);
    Bench bench = fast_bench();
    bench.plant.motor.R_a *= draw.within(0.8, 1.3);
    bench.plant.motor.J *= draw.within(0.8, 1.5);
    const Discovery d = asked(bench, record(bench, bench.train, seed + 500 + i), seed + 500 + i);
    laws += d.law ? 1 : 0;
    changed += d.changed.empty() ? 0 : 1;
    disturbed += d.disturbances.empty() ? 0 : 1;
  }
  std::cout << "healthy: a law " << of(laws, count) << ", a changed parameter " << of(changed, count)
            << ", a disturbance " << of(disturbed, count) << "\n";
}

void judge_changed(std::size_t count, std::uint64_t seed) {
  std::size_t right = 0, others = 0;
  for (std::size_t i = 0; i < count; ++i) {
    Draw draw(seed + 1000 * i);
    const Bench bench = fast_bench();
    Bench other = bench;
    const std::size_t run = draw.below(bench.train.size());
    const bool inertia = draw.chance(0.5);
    (inertia ? other.plant.motor.J : other.plant.motor.R_a) *= 1 + draw.sign() * draw.log_within(0.05, 0.3);
    auto runs = record(bench, bench.train, seed + i);
    runs[run] = record(other, other.train[run], seed + i + 50);
    const Discovery d = asked(bench, runs, seed + i);
    bool found = false;
    for (const Changed& c : d.changed) {
      const bool is_it = c.run == runs[run].name && c.parameter == (inertia ? "J" : "R_a");
      found = found || is_it;
      others += is_it ? 0 : 1;
    }
    right += found ? 1 : 0;
  }
  std::cout << "a changed parameter found: " << of(right, count) << ", others named: " << others << "\n";
}

void judge_disturbances(std::size_t count, std::uint64_t seed) {
  std::size_t right = 0, others = 0;
  for (std::size_t i = 0; i < count; ++i) {
    Draw draw(seed + 1000 * i);
    const Bench bench = fast_bench();
    Bench other = bench;
    const double from = draw.within(1.2, 2.2), lasts = 0.3, torque = draw.sign() * draw.log_within(0.005, 0.03);
    other.plant.hidden_torque = [=](double, double, double t) { return t > from && t < from + lasts ? torque : 0; };
    auto runs = record(bench, bench.train, seed + i);
    runs[0] = record(other, other.train[0], seed + i + 50);
    const Discovery d = asked(bench, runs, seed + i);
    bool found = false;
    for (const Disturbance& x : d.disturbances) {
      const bool is_it = x.run == runs[0].name && x.from_s < from + lasts && x.to_s > from;
      found = found || is_it;
      others += is_it ? 0 : 1;
    }
    right += found ? 1 : 0;
  }
  std::cout << "a disturbance found: " << of(right, count) << ", others named: " << others << "\n";
}

}  // namespace
}  // namespace emtb::blind

int main(int argc, char** argv) {
  const std::size_t count = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 20;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  try {
    emtb::blind::judge_laws(count, seed);
    emtb::blind::judge_healthy(count, seed);
    emtb::blind::judge_changed(count, seed);
    emtb::blind::judge_disturbances(count, seed);
  } catch (const emtb::Error& e) {
    std::cerr << e.what() << "\n";
    return 2;
  }
  return 0;
}
