/// Hides laws that the grammar does not hold exactly on the simulated servo, splines over the speed and tables over
/// the angle, and counts what `discover` makes of them; then runs of one machine, of a machine that changed, and
/// disturbed ones: docs/discover.md. Arguments: what (law, law_of_angle, friction_over_angle, law_with_memory, healthy,
/// lacking, changed, from_then, drift, disturbed, all), how many, seed, the first.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <string>
#include <vector>

#include "analysis/discover/discover.h"
#include "config/formula_effect.h"
#include "hal/error.h"
#include "model/catalogue.h"
#include "tests/blind/curve_error.h"
#include "tests/blind/draw.h"
#include "tests/blind/recording.h"
#include "tests/blind/same_machine.h"

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

/// A torque over the angle in the turn that is no few waves: straight between nine random values of a turn.
class HiddenTurn {
 public:
  HiddenTurn(Draw draw, double size) {
    double mean = 0;
    for (double& v : value_) mean += (v = size * draw.within(0, 1)) / count;
    for (double& v : value_) v -= mean;  // the mean is a load's or a dry friction's
  }

  double operator()(double theta) const {
    const double turns = theta / two_pi - std::floor(theta / two_pi), at = turns * count;
    const auto k = std::min(static_cast<std::size_t>(at), count - 1);
    const double s = at - static_cast<double>(k);
    return (1 - s) * value_[k] + s * value_[(k + 1) % count];
  }

  double least() const { return *std::ranges::min_element(value_); }

 private:
  static constexpr std::size_t count = 9;
  static constexpr double two_pi = 6.283185307179586;
  std::array<double, count> value_{};
};

/// A curve of the speed that comes late, or dry friction in elements that give before they slip, each over an angle of
/// its own (Prandtl and Ishlinskii). It remembers what was before: a copy of its own for each run.
class HiddenMemory {
 public:
  HiddenMemory(Draw draw, double range, double size)
      : curve_(draw, range, size), late_(draw.within(0, 1) < 0.5), tau_(draw.log_within(0.05, 1)) {
    double sum = 0;
    for (Element& e : elements_) {
      e.angle = draw.log_within(2, 60);
      e.torque = draw.within(0.2, 1);
      sum += e.torque;
    }
    for (Element& e : elements_) e.torque *= size / sum;
  }

  double operator()(double omega, double theta, double t) {
    if (t < t_ || t == 0) begin(omega, theta);
    const double h = t - t_, turned = theta - theta_;
    t_ = t;
    theta_ = theta;
    late_by_ += (1 - std::exp(-h / tau_)) * (curve_(omega) - late_by_);
    double torque = 0;
    for (Element& e : elements_) {
      e.bent = std::clamp(e.bent + turned / e.angle, -1.0, 1.0);
      torque += e.torque * e.bent;
    }
    return late_ ? late_by_ : torque;
  }

 private:
  void begin(double omega, double theta) {
    t_ = 0;
    theta_ = theta;
    late_by_ = curve_(omega);
    for (Element& e : elements_) e.bent = 0;
  }

  struct Element {
    double angle = 1, torque = 0;  ///< [rad, N m]
    double bent = 0;               ///< of its angle
  };
  HiddenCurve curve_;
  bool late_;
  double tau_;
  std::array<Element, 4> elements_;
  double t_ = 0, theta_ = 0, late_by_ = 0;
};

/// What it does along a run, as formulas have it; the states between two of the run are straight lines.
std::vector<double> along(HiddenMemory hidden, const MissingTorque& run) {
  constexpr int parts = 20;
  std::vector<double> torque{-hidden(run.omega[0], run.theta[0], 0)};
  for (std::size_t k = 0; k + 1 < run.t.size(); ++k) {
    const double h = run.t[k + 1] - run.t[k];
    for (int i = 1; i <= parts; ++i) {
      const double share = static_cast<double>(i) / parts;
      const auto at = [&](const std::vector<double>& x) { return (1 - share) * x[k] + share * x[k + 1]; };
      const double braking = hidden(at(run.omega), at(run.theta), run.t[k] - run.t[0] + share * h);
      if (i == parts) torque.push_back(-braking);
    }
  }
  return torque;
}

double excess(double error) { return std::max(0.0, error * error - 1); }

/// What is hidden in one case: on a bench, and as the curve that a law is held against.
struct HiddenLaw {
  std::function<double(double omega, double theta, double t)> braking;  ///< [N m]
  std::string over;
  std::function<double(double)> curve;  ///< as formulas have it: it accelerates
  double beneath = 0;                   ///< [N m] of dry friction that the model knows: no friction drives a shaft
  std::function<std::vector<double>(const MissingTorque&)> along =
      nullptr;  ///< in place of a curve, where it remembers
};

/// Some 4000 counts a turn, over the two thousand turns of the longest run.
simulated::DaqChannel encoder() {
  constexpr double half = 2000 * 3.141592653589793;
  return {.signal = Signal::theta, .low = -half, .high = half, .bits = 23, .noise = 0};
}

HiddenLaw hidden_law(const std::string& kind, Draw& draw) {
  constexpr double fastest = 450;
  const bool turns = kind == "law_of_angle" || kind == "friction_over_angle";
  const double size = (turns ? 5 : 1) * draw.log_within(0.01, 0.04);  // inertia smooths what turns with the angle
  if (kind == "law") {
    const HiddenCurve curve(draw, fastest, size);
    return {[curve](double omega, double, double) { return curve(omega); }, "omega",
            [curve](double omega) { return -curve(omega); }};
  }
  if (kind == "law_with_memory") {
    const HiddenMemory memory(draw, fastest, size);
    return {.braking = memory, .over = "omega", .curve = {}, .along = [memory](const MissingTorque& run) {
              return along(memory, run);
            }};
  }
  const HiddenTurn turn(draw, size);
  const bool friction = kind == "friction_over_angle";
  return {[turn, friction](double omega, double theta, double) {
            return friction ? std::tanh(omega) * turn(theta) : -turn(theta);
          },
          "theta", [turn, friction](double theta) { return (friction ? -1 : 1) * turn(theta); },
          friction ? -turn.least() : 0};
}

void judge_laws(const std::string& kind, std::size_t first, std::size_t count, std::uint64_t seed) {
  std::size_t offered = 0, shaped = 0;
  std::vector<double> removed;
  for (std::size_t i = first; i < first + count; ++i) {
    Draw draw(seed + 1000 * i);
    Bench bench = fast_bench();
    const HiddenLaw hidden = hidden_law(kind, draw);
    bench.plant.hidden_torque = hidden.braking;
    if (hidden.over == "theta") bench.channels.push_back(encoder());
    if (hidden.beneath > 0) {
      const std::size_t effect = effect_index("coulomb_friction");
      bench.plant.friction.T_c = hidden.beneath;
      bench.model.include(effect);
      bench.model.parameters_of(effect).front().value = hidden.beneath;
    }
    const Discovery d = asked(bench, record(bench, bench.train, seed + i), seed + i);
    double gone = 0, wrong = 1;
    if (d.law) {
      ++offered;
      gone = 1 - excess(d.law->held_out_after) / excess(d.law->held_out_before);
      wrong = hidden.along ? error_along(*d.law, d.left, hidden.along)
                           : curve_error(*d.law, hidden.over, hidden.curve, kind == "law");
      shaped += wrong < 0.1 ? 1 : 0;
    }
    removed.push_back(gone);
    std::cout << kind << " " << i << ": held-out " << d.held_out << (d.law ? " -> " : "")
              << (d.law ? std::to_string(d.law->held_out_after) + " by " + d.law->text.in_words() : " no law")
              << ", ceiling " << d.torque.ceiling << ", removed " << gone << ", curve off by " << wrong << "\n"
              << std::flush;
  }
  std::ranges::sort(removed);
  std::cout << "a law offered: " << counted_with_interval(offered, count)
            << "; shape right: " << counted_with_interval(shaped, count)
            << "; excess removed on held-out runs, median: " << (removed.empty() ? 0 : removed[count / 2]) << "\n";
}

/// Cases of one kind: what is found of what an oracle sees, and what is named that is not there.
void judge_machines(MachineKind kind, std::size_t first, std::size_t count, std::uint64_t seed) {
  std::size_t visible = 0, found = 0, unseen_found = 0, otherwise = 0, changes = 0, disturbances = 0, laws = 0;
  double seconds = 0;
  for (std::size_t i = first; i < first + count; ++i) {
    const MachineCase c = make_machine_case(kind, i, seed);
    const MachineAnswer a = ask(c);
    visible += a.visible ? 1 : 0;
    found += a.visible && a.found ? 1 : 0;
    unseen_found += !a.visible && a.found ? 1 : 0;
    otherwise += a.otherwise ? 1 : 0;
    changes += a.change_named ? 1 : 0;
    disturbances += a.disturbance_named ? 1 : 0;
    laws += a.law_offered ? 1 : 0;
    seconds += a.seconds;
    std::cout << c.id << " " << c.run << " " << c.parameter << " " << c.by << " " << c.from_s << ":" << c.to_s << " "
              << c.torque << " squares " << c.squares << (a.visible ? " seen by the oracle" : "")
              << (a.found ? " FOUND" : "") << (a.otherwise ? " OTHERWISE" : "") << (a.law_offered ? " LAW" : "") << " :"
              << a.said << " " << a.seconds << " s\n"
              << std::flush;
  }
  std::cout << name_of(kind) << ": seen by the oracle " << visible << " of " << count << "; found of these "
            << counted_with_interval(found, visible) << ", of the others " << unseen_found << "; something else named "
            << counted_with_interval(otherwise, count) << "; a law offered " << counted_with_interval(laws, count)
            << "; changed named " << changes << ", disturbed named " << disturbances << "; "
            << seconds / static_cast<double>(std::max<std::size_t>(1, count)) << " s each\n"
            << std::flush;
}

}  // namespace
}  // namespace emtb::blind

int main(int argc, char** argv) {
  using emtb::blind::MachineKind;
  const std::string kind = argc > 1 ? argv[1] : "all";
  const std::size_t count = argc > 2 ? std::strtoul(argv[2], nullptr, 10) : 20;
  const std::uint64_t seed = argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 1;
  const std::size_t first = argc > 4 ? std::strtoul(argv[4], nullptr, 10) : 0;
  try {
    for (const std::string one : {"law", "law_of_angle", "friction_over_angle", "law_with_memory"}) {
      if (kind == one || kind == "all") emtb::blind::judge_laws(one, first, count, seed);
    }
    for (const MachineKind one : {MachineKind::healthy, MachineKind::lacking, MachineKind::changed,
                                  MachineKind::from_then, MachineKind::drift, MachineKind::disturbed}) {
      if (kind == name_of(one) || kind == "all") emtb::blind::judge_machines(one, first, count, seed);
    }
  } catch (const emtb::Error& e) {
    std::cerr << e.what() << "\n";
    return 2;
  }
  return 0;
}
