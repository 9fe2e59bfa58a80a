#include "analysis/discover/grammar.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>

#include "analysis/numerics/linear_algebra.h"
#include "analysis/numerics/parallel.h"
#include "hal/error.h"
#include "model/machine/memory.h"

namespace emtb {
namespace {

using Place = FormulaText::Parameter;

const char* key_of(TermPlace place) {
  return place == TermPlace::torque ? "torque" : place == TermPlace::voltage ? "voltage" : "flux";
}

std::string digits(double value) {
  std::ostringstream text;
  text.precision(7);
  text << value;
  return text.str();
}

Place amplitude(const std::string& symbol, const std::string& unit, double most) {
  return {symbol, unit, 0, -most, most, true, false};
}

Place shape(const std::string& symbol, const std::string& unit, double low, double high) {
  return {symbol, unit, std::sqrt(low * high), low, high, false, false};
}

Place constant(const std::string& symbol, const std::string& unit, double value) {
  return {symbol, unit, value, value, value, false, true};
}

/// The odd laws of a signed quantity x: those that oppose it.
void add_odd(std::vector<FormulaText>& list, TermPlace place, const std::string& x, const std::string& unit,
             double range, double most) {
  const std::string out = place == TermPlace::torque ? "N m" : "V", size = "abs(" + x + ")", id = key_of(place);
  const std::string after = "_of_" + x;
  const double small = 0.02 * range;
  const auto add = [&](const std::string& name, const std::string& formula, std::vector<Place> p) {
    p.insert(p.begin(), amplitude("a", out, most));
    list.push_back({name + "_" + id + after, place, formula, {x}, std::move(p)});
  };
  add("power", "-a*tanh(" + x + "/s)*(" + size + "/r)^n",
      {shape("n", "1", 0.2, 5), constant("r", unit, range), turning_width("s", unit, range)});
  add("saturating", "-a*tanh(" + x + "/w)", {shape("w", unit, 0.5 * small, 2 * range)});
  add("decaying", "-a*tanh(" + x + "/s)*exp(-" + size + "/w)",
      {shape("w", unit, small, 2 * range), turning_width("s", unit, range)});
  add("hyperbolic", "-2*a*(" + x + "/w)/(1 + (" + x + "/w)^2)", {shape("w", unit, small, 2 * range)});
  add("dead_zone", "-a*sign(" + x + ")*max(0, " + size + "/w - 1)", {shape("w", unit, small, 0.9 * range)});
  add("bump", "-a*tanh(" + x + "/s)*exp(-((" + size + " - c)/w)^2)",
      {shape("c", unit, small, range), shape("w", unit, 0.04 * range, range), turning_width("s", unit, range)});
  add("wave", "-a*sin(" + x + "/w)", {shape("w", unit, 0.03 * range, 0.6 * range)});
}

/// The odd laws of two terms: those of a friction that holds beside one that grows, falls or waves.
void add_sums(std::vector<FormulaText>& list, TermPlace place, const std::string& x, const std::string& unit,
              double range, double most) {
  const std::string out = place == TermPlace::torque ? "N m" : "V", size = "abs(" + x + ")";
  const std::string side = "tanh(" + x + "/s)", share = "(" + x + "/r)";
  const double small = 0.02 * range;
  const auto a = amplitude("a", out, most), b = amplitude("b", out, most), c = amplitude("c", out, most);
  const auto s = turning_width("s", unit, range), r = constant("r", unit, range);
  const auto add = [&](const std::string& name, const std::string& formula, std::vector<Place> p) {
    list.push_back({name + "_" + key_of(place) + "_of_" + x, place, formula, {x}, std::move(p)});
  };
  add("square_and_cube", "-a*" + share + "*abs" + share + " - b*" + share + "^3", {a, b, r});
  add("series", "-a*" + share + "*abs" + share + " - b*" + share + "^3 - c*" + share + "^3*abs" + share, {a, b, c, r});
  add("falling_from", "-" + side + "*(a + b*exp(-" + size + "/w))", {a, b, shape("w", unit, small, range), s});
  add("dry_and_power", "-" + side + "*(a + b*(" + size + "/r)^n)", {a, b, shape("n", "1", 0.3, 5), r, s});
  add("dry_and_wave", "-a*" + side + " - b*sin(" + x + "/w)", {a, b, shape("w", unit, 0.03 * range, 0.6 * range), s});
  add("saturating_and_square", "-a*tanh(" + x + "/w) - b*" + share + "*abs" + share,
      {a, b, shape("w", unit, small, 2 * range), r});
}

void add_even(std::vector<FormulaText>& list, TermPlace place, const std::string& x, const std::string& unit,
              double range, double most) {
  const std::string out = place == TermPlace::torque ? "N m" : "V", id = key_of(place);
  const auto w = shape("w", unit, 0.02 * range, 2 * range);
  list.push_back({"even_" + id + "_of_" + x, place, "-a*tanh(abs(" + x + ")/w)", {x}, {amplitude("a", out, most), w}});
  list.push_back(
      {"fading_" + id + "_of_" + x, place, "-a*exp(-abs(" + x + ")/w)", {x}, {amplitude("a", out, most), w}});
}

void add_waves_of_angle(std::vector<FormulaText>& list, double most) {
  for (const int order : {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 14, 16, 18, 20, 24}) {
    list.push_back({"wave_of_angle_" + std::to_string(order),
                    TermPlace::torque,
                    "a*cos(n*theta) + b*sin(n*theta)",
                    {"theta"},
                    {amplitude("a", "N m", most), amplitude("b", "N m", most), constant("n", "1", order)}});
  }
}

/// Friction that is not alike all around the turn: a bent shaft, a seal, a bearing's race.
void add_friction_over_angle(std::vector<FormulaText>& list, double omega, double most) {
  for (const int order : {1, 2, 3, 4, 6}) {
    list.push_back({"friction_over_angle_" + std::to_string(order),
                    TermPlace::torque,
                    "-tanh(omega/s)*(a*cos(n*theta) + b*sin(n*theta))",
                    {"theta", "omega"},
                    {amplitude("a", "N m", most), amplitude("b", "N m", most), constant("n", "1", order),
                     turning_width("s", "rad/s", omega)}});
  }
}

/// Friction that grows with speed and current, or either.
void add_of_speed_and_current(std::vector<FormulaText>& list, double omega, double current, double most) {
  list.push_back({"friction_of_speed_and_current",
                  TermPlace::torque,
                  "-a*tanh(omega/s)*(abs(omega)/r)^n*(abs(i_a)/q)^m",
                  {"omega", "i_a"},
                  {amplitude("a", "N m", most), shape("n", "1", 0.05, 4), shape("m", "1", 0.05, 4),
                   constant("r", "rad/s", omega), constant("q", "A", current), turning_width("s", "rad/s", omega)}});
}

void add_of_time(std::vector<FormulaText>& list, double longest, double omega, double torque) {
  const auto tau = shape("tau", "s", 0.03 * longest, 3 * longest);
  list.push_back({"fading_torque_of_t",
                  TermPlace::torque,
                  "-a*tanh(omega/s)*exp(-t/tau)",
                  {"t", "omega"},
                  {amplitude("a", "N m", torque), tau, turning_width("s", "rad/s", omega)}});
  list.push_back({"constant_torque_fading_with_t",
                  TermPlace::torque,
                  "-a*exp(-t/tau)",
                  {"t"},
                  {amplitude("a", "N m", torque), tau}});
}

constexpr double largest_weakening = 0.5;  // of the flux

void add_flux(std::vector<FormulaText>& list, double omega, double current, double longest) {
  list.push_back({"flux_bent_by_current",
                  TermPlace::flux,
                  "1 - a*tanh(abs(i_a)/w)",
                  {"i_a"},
                  {amplitude("a", "1", largest_weakening), shape("w", "A", 0.05 * current, 3 * current)}});
  list.push_back({"flux_bent_by_speed",
                  TermPlace::flux,
                  "1 - a*(abs(omega)/r)^n",
                  {"omega"},
                  {amplitude("a", "1", largest_weakening), shape("n", "1", 0.2, 5), constant("r", "rad/s", omega)}});
  list.push_back({"flux_of_time",
                  TermPlace::flux,
                  "1 - a*(1 - exp(-t/tau))",
                  {"t"},
                  {amplitude("a", "1", largest_weakening), shape("tau", "s", 0.03 * longest, 3 * longest)}});
}

/// [s] Of two places of a run.
double longest_interval(const Samples& samples) {
  double longest = 0;
  for (const MissingTorque& run : samples.paths) longest = std::max(longest, run.t[1] - run.t[0]);
  return longest;
}

/// What a formula gives to a rate over a time: the law itself, a lag behind.
std::string follows(const std::string& law) { return "(" + law + " - z)/tau"; }

/// A law of one quantity that remembers.
void add_remembering(std::vector<FormulaText>& list, const std::string& id, TermPlace place, const std::string& of,
                     const std::string& formula, const std::string& rate, std::vector<Place> p) {
  list.push_back({.id = id, .place = place, .formula = formula, .of = {of}, .parameters = std::move(p), .rate = rate});
}

void add_remembered_friction(std::vector<FormulaText>& list, const Place& tau, double omega, double path, double most) {
  const double small = 0.02 * omega;
  const auto s = turning_width("s", "rad/s", omega), r = constant("r", "rad/s", omega),
             w = shape("w", "rad/s", small, 2 * omega);
  const auto add = [&](const std::string& id, const std::string& formula, const std::string& rate,
                       std::vector<Place> p) {
    p.insert(p.begin(), amplitude("a", "N m", most));
    add_remembering(list, id, TermPlace::torque, "omega", formula, rate, std::move(p));
  };
  add("lagging_power_of_omega", "-a*z", follows("tanh(omega/s)*(abs(omega)/r)^n"),
      {tau, shape("n", "1", 0.05, 5), r, s});
  add("lagging_saturation_of_omega", "-a*z", follows("tanh(omega/w)"), {tau, w});
  add("lagging_decay_of_omega", "-a*z", follows("tanh(omega/s)*exp(-abs(omega)/w)"), {tau, w, s});
  add("lagging_hyperbola_of_omega", "-a*z", follows("2*(omega/w)/(1 + (omega/w)^2)"), {tau, w});
  add("warming_friction_of_omega", "-a*tanh(omega/s)*z", follows("abs(omega)/r"), {tau, r, s});
  const auto way = shape("w", "rad", 0.02 * path, 20 * path);
  add("giving_friction_of_omega", "-a*z", "(omega - abs(omega)*z)/w", {way});
  add("giving_friction_by_a_power_of_omega", "-a*z", "omega/w*max(0, 1 - sign(omega)*z)^n",
      {way, shape("n", "1", 0.2, 5)});
}

/// The values of a shape that are tried: even by ratio.
std::vector<double> grid_of(const Place& p, std::size_t count) {
  if (p.fixed) return {p.value};
  std::vector<double> grid;
  for (std::size_t i = 0; i < count; ++i) {
    const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(count);
    grid.push_back(p.min * std::pow(p.max / p.min, share));
  }
  return grid;
}

/// One sentence on all samples.
class Fitter {
 public:
  Fitter(const Samples& s, const FormulaText& law, const AddedTerm& term, double torque_per_ampere)
      : s_(s), law_(law), term_(term), torque_per_ampere_(torque_per_ampere) {
    for (std::size_t i = 0; i < law.parameters.size(); ++i) {
      if (law.parameters[i].amplitude) amplitudes_.push_back(i);
    }
    // The term may take its parameters in another order than the text.
    for (const Parameter& p : term.parameters) {
      const auto at = std::ranges::find(law.parameters, p.symbol, &Place::symbol) - law.parameters.begin();
      order_.push_back(static_cast<std::size_t>(at));
    }
  }

  EquationError best() {
    EquationError found{law_, 0};
    try_shapes(0, found);
    return found;
  }

 private:
  void try_shapes(std::size_t i, EquationError& found) {
    if (i == law_.parameters.size()) {
      judge(found);
      return;
    }
    if (law_.parameters[i].amplitude) {
      try_shapes(i + 1, found);
      return;
    }
    const auto shapes = std::ranges::count_if(law_.parameters, [](const Place& p) { return !p.amplitude && !p.fixed; });
    for (const double value : grid_of(law_.parameters[i], shapes > 1 ? 8 : 16)) {
      law_.parameters[i].value = value;
      try_shapes(i + 1, found);
    }
  }

  /// The shapes as they are, and one amplitude.
  std::vector<double> values_with(std::size_t which) const {
    std::vector<double> p(order_.size());
    for (std::size_t k = 0; k < order_.size(); ++k) {
      const Place& from = law_.parameters[order_[k]];
      p[k] = from.amplitude ? (order_[k] == which ? 1.0 : 0.0) : from.value;
    }
    return p;
  }

  double value_at(std::size_t row, double memory, std::span<const double> p, std::span<double> by) const {
    TermInput by_input;
    const TermInput at{s_.omega[row], s_.i_a[row], s_.theta[row], s_.u_ref[row], s_.t[row], memory};
    const double v = term_.term->evaluate(at, p, by_input, by);
    return law_.place == TermPlace::flux ? (v - 1) * torque_per_ampere_ * s_.i_a[row] : v;
  }

  /// What the law remembers at each sample.
  std::vector<double> remembered(std::span<const double> p) const {
    std::vector<double> at_samples(s_.size(), 0.0);
    if (!term_.rate) return at_samples;
    std::vector<std::vector<double>> along;
    for (const MissingTorque& run : s_.paths) along.push_back(memory_along(term_, p, run));
    for (std::size_t row = 0; row < s_.size(); ++row) at_samples[row] = along[s_.path[row]][s_.place[row]];
    return at_samples;
  }

  void judge(EquationError& found) {
    const auto n = static_cast<Eigen::Index>(s_.size()), m = static_cast<Eigen::Index>(amplitudes_.size());
    Eigen::MatrixXd x(n, 4 + m);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto row = static_cast<std::size_t>(i);
      x.row(i).head(4) << s_.value[row], s_.omega[row], s_.i_a[row], s_.acceleration[row];
    }
    std::vector<double> by(order_.size());
    for (Eigen::Index a = 0; a < m; ++a) {
      const std::vector<double> p = values_with(amplitudes_[static_cast<std::size_t>(a)]), memory = remembered(p);
      for (Eigen::Index i = 0; i < n; ++i) {
        const auto row = static_cast<std::size_t>(i);
        x(i, 4 + a) = value_at(row, memory[row], p, by);
      }
    }
    if (!x.allFinite()) return;
    std::vector<Eigen::MatrixXd> of(s_.groups, Eigen::MatrixXd::Zero(4 + m, 4 + m));
    Eigen::Index begin = 0;
    for (Eigen::Index end = 1; end <= n; ++end) {
      const std::size_t group = s_.group[static_cast<std::size_t>(begin)];
      if (end < n && s_.group[static_cast<std::size_t>(end)] == group) continue;
      of[group] += gram(x.middleRows(begin, end - begin));
      begin = end;
    }
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(4 + m, 4 + m);
    for (const Eigen::MatrixXd& g : of) all += g;
    double with = 0, without = 0;
    for (const Eigen::MatrixXd& g : of) {
      with += squares_left(all - g, g, 3 + m);
      without += squares_left(all - g, g, 3);
    }
    const double share = without > 0 ? 1 - with / without : 0;
    if (!(share > found.share)) return;
    const Eigen::VectorXd value = solve_normal(all.bottomRightCorner(3 + m, 3 + m), all.col(0).tail(3 + m));
    for (Eigen::Index a = 0; a < m; ++a) {
      Place& p = law_.parameters[amplitudes_[static_cast<std::size_t>(a)]];
      p.value = std::clamp(value[3 + a], p.min, p.max);
    }
    found = {law_, share};
  }

  /// Of one group, by what was fitted to the others. @param columns behind the first, which is what they are to explain
  static double squares_left(const Eigen::MatrixXd& others, const Eigen::MatrixXd& own, Eigen::Index columns) {
    const Eigen::VectorXd v = solve_normal(others.block(1, 1, columns, columns), others.col(0).segment(1, columns));
    Eigen::VectorXd left = Eigen::VectorXd::Zero(columns + 1);
    left[0] = 1;
    left.tail(columns) = -v;
    return left.dot(own.topLeftCorner(columns + 1, columns + 1) * left);
  }

  const Samples& s_;
  FormulaText law_;
  const AddedTerm& term_;
  double torque_per_ampere_;
  std::vector<std::size_t> amplitudes_, order_;
};

}  // namespace

FormulaText::Parameter turning_width(const std::string& symbol, const std::string& unit, double range) {
  const double width = 0.004 * range;
  return {symbol, unit, width, 0.1 * width, 5 * width, false, true};
}

FormulaText::Parameter time_to_follow(const Samples& samples) {
  constexpr double part = 0.3;  // of an interval, within which a memory can still be seen, and of a run
  double longest = 0;
  for (const MissingTorque& run : samples.paths) longest = std::max(longest, run.t.back() - run.t.front());
  return shape("tau", "s", part * longest_interval(samples), part * longest);
}

std::string FormulaText::yaml() const {
  std::string text = id + ":\n  " + key_of(place) + ": \"" + formula + "\"\n";
  if (!rate.empty()) text += "  memory: {z: \"" + rate + "\"}\n";
  text += "  parameters:\n";
  for (const Parameter& p : parameters) {
    text += "    " + p.symbol + ": {value: " + digits(p.value);
    text += p.fixed ? ", fixed: true" : ", min: " + digits(p.min) + ", max: " + digits(p.max);
    if (p.amplitude) text += ", null: 0";
    text += ", unit: " + p.unit + "}\n";
  }
  return text;
}

std::vector<FormulaText> sentences(const Samples& samples, double torque_scale, double voltage_scale, bool voltage) {
  std::vector<FormulaText> list;
  const double omega = range_of(samples.omega), current = range_of(samples.i_a), longest = range_of(samples.t),
               reference = range_of(samples.u_ref);
  if (voltage) {
    add_odd(list, TermPlace::voltage, "i_a", "A", current, largest_law * voltage_scale);
    add_odd(list, TermPlace::voltage, "omega", "rad/s", omega, largest_law * voltage_scale);
    return list;
  }
  const double torque = largest_law * torque_scale;
  add_odd(list, TermPlace::torque, "omega", "rad/s", omega, torque);
  add_sums(list, TermPlace::torque, "omega", "rad/s", omega, torque);
  add_even(list, TermPlace::torque, "omega", "rad/s", omega, torque);
  add_odd(list, TermPlace::torque, "i_a", "A", current, torque);
  if (reference > 0) add_odd(list, TermPlace::torque, "u_ref", "V", reference, torque);
  add_waves_of_angle(list, torque);
  if (turns_both_ways(samples)) add_friction_over_angle(list, omega, torque);
  add_of_time(list, longest, omega, torque);
  if (current > 0) add_of_speed_and_current(list, omega, current, torque);
  add_flux(list, omega, current, longest);
  return list;
}

std::vector<FormulaText> remembering_sentences(const Samples& samples, double torque_scale, double voltage_scale,
                                               bool voltage) {
  std::vector<FormulaText> list;
  if (samples.paths.empty()) return list;
  const double omega = range_of(samples.omega), current = range_of(samples.i_a);
  const Place tau = time_to_follow(samples), r = constant("r", "A", current);
  if (voltage) {
    add_remembering(list, "lagging_voltage_of_i_a", TermPlace::voltage, "i_a", "-a*z", follows("i_a/r"),
                    {amplitude("a", "V", largest_law * voltage_scale), tau, r});
    return list;
  }
  const double torque = largest_law * torque_scale;
  add_remembered_friction(list, tau, omega, omega * longest_interval(samples), torque);
  add_remembering(list, "lagging_torque_of_i_a", TermPlace::torque, "i_a", "-a*z", follows("i_a/r"),
                  {amplitude("a", "N m", torque), tau, r});
  add_remembering(list, "flux_heated_by_i_a", TermPlace::flux, "i_a", "1 - a*z", follows("(i_a/r)^2"),
                  {amplitude("a", "1", largest_weakening), tau, r});
  return list;
}

std::vector<double> memory_along(const AddedTerm& law, std::span<const double> p, const MissingTorque& run) {
  std::vector<double> by(p.size()), along;
  const bool rests = std::abs(run.omega[0]) < moves * range_of(run.omega);
  TermInput at{rests ? 0 : run.omega[0], run.i_a[0], run.theta[0], run.u_ref[0], run.t[0]};
  const auto rate = rate_over_memory(*law.rate, at, p, by);
  along.push_back(lasting_memory<double>(rate));
  for (std::size_t k = 0; k + 1 < run.t.size(); ++k) {
    const auto between = [k](const std::vector<double>& x) { return 0.5 * (x[k] + x[k + 1]); };
    at = {between(run.omega), between(run.i_a), between(run.theta), between(run.u_ref), between(run.t)};
    along.push_back(remembered_after(along.back(), run.t[k + 1] - run.t[k], rate).end);
  }
  return along;
}

std::vector<EquationError> by_equation_error(const Samples& samples, const std::vector<FormulaText>& laws,
                                             const ReadFormula& read, double motor_torque_per_ampere) {
  std::vector<AddedTerm> terms;
  for (const FormulaText& law : laws) terms.push_back(read(law));
  std::vector<EquationError> found(laws.size());
  parallel_for(laws.size(),
               [&](std::size_t i) { found[i] = Fitter(samples, laws[i], terms[i], motor_torque_per_ampere).best(); });
  std::erase_if(found, [](const EquationError& e) { return !(e.share > 0); });
  std::ranges::stable_sort(found, std::greater{}, &EquationError::share);
  return found;
}

}  // namespace emtb
