#include "export/controller.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "hal/error.h"

namespace emtb {
namespace {

using Complex = std::complex<double>;
constexpr double turn = 2 * std::numbers::pi;

Complex pi_at(const Pi& c, Complex s) { return c.kp + c.ki / s; }

/// The open speed loop at a frequency [rad/s].
Complex open_loop(const Gains& g, const LinearMachine& m, Loop loop, double rate, double w) {
  const Complex s(0, w);
  const Complex late = std::exp(-s * (1.5 / rate + m.delay)) / (1.0 + s * m.lag);
  const Complex shaft = m.J * s + m.B, circuit = m.L * s + m.R;
  if (loop == Loop::direct) return pi_at(g.direct, s) * late * m.K_m / (circuit * shaft + m.K_b * m.K_m);
  // Current and shaft with the back-EMF, of which the decoupling takes a part, as late as the rest.
  const Complex current = pi_at(g.current, s) * late;
  const Complex left = (m.K_b - g.back_emf * late) * m.K_m / shaft;
  return pi_at(g.speed, s) * m.K_m / shaft * current / (circuit + current + left);
}

}  // namespace

Gains gains_for(const LinearMachine& m, const LoopWishes& wishes) {
  Gains g;
  constexpr double samples = 20, slower = 5, corner = 0.2;
  const double own = (m.B + m.K_b * m.K_m / m.R) / m.J / turn;  // [Hz] of the motor by itself
  g.current_bandwidth = wishes.current_bandwidth > 0 ? wishes.current_bandwidth : wishes.rate / samples;
  const double late = m.lag + m.delay;
  if (wishes.current_bandwidth <= 0 && late > 0)
    g.current_bandwidth = std::min(g.current_bandwidth, 1 / (turn * 3 * late));
  g.speed_bandwidth =
      wishes.speed_bandwidth > 0 ? wishes.speed_bandwidth : std::min(2 * own, g.current_bandwidth / slower);
  // What is left of 90 degrees where the current loop's gain is 1.
  const auto current_margin = [&] {
    const double w = turn * g.current_bandwidth;
    return (turn / 4 - w * (1.5 / wishes.rate + m.delay) - std::atan(w * m.lag)) * 360 / turn;
  };
  constexpr double calm = 45, least = 30;  // [degree]
  if (wishes.current_bandwidth <= 0) {
    g.current_bandwidth = std::max(g.current_bandwidth, slower * g.speed_bandwidth);
    while (current_margin() < calm && g.current_bandwidth > 2 * g.speed_bandwidth) g.current_bandwidth *= 0.9;
  }
  if (current_margin() < least) {
    throw ModelError("a current loop of " + std::to_string(std::lround(g.current_bandwidth)) +
                     " Hz, for a speed loop of " + std::to_string(std::lround(g.speed_bandwidth)) +
                     " Hz, would ring: driver and controller are too late for it. Lower --bandwidth, or raise --rate");
  }
  const double wc = turn * g.current_bandwidth, ws = turn * g.speed_bandwidth;
  g.current = {m.L * wc, m.R * wc};
  g.back_emf = m.K_b;
  g.speed = {m.J * ws / m.K_m, m.J * ws / m.K_m * ws * corner};
  g.direct = {ws * (m.R * m.J + m.L * m.B) / m.K_m, ws * (m.R * m.B + m.K_b * m.K_m) / m.K_m};
  return g;
}

Margins margins_of(const Gains& g, const LinearMachine& m, Loop loop, double rate) {
  Margins out{.phase = 180, .gain = std::numeric_limits<double>::infinity()};
  constexpr int per_decade = 400;
  const double highest = turn * rate / 2, lowest = turn * g.speed_bandwidth * 1e-3;
  double phase = 0, before = 0, size_before = 0, w_before = 0;
  const int n = static_cast<int>(std::ceil(per_decade * std::log10(highest / lowest)));
  for (int k = 0; k <= n; ++k) {
    const double w = lowest * std::pow(10.0, static_cast<double>(k) / per_decade);
    const Complex at = open_loop(g, m, loop, rate, w);
    double angle = std::arg(at);
    if (k == 0 && angle > 0) angle -= turn;
    while (k > 0 && angle - before > std::numbers::pi) angle -= turn;
    while (k > 0 && angle - before < -std::numbers::pi) angle += turn;
    phase = angle;
    const double size = std::abs(at);
    if (k > 0 && size_before >= 1 && size < 1) {
      const double share = std::log(size_before) / std::log(size_before / size);
      const double margin = 180 + (before + share * (phase - before)) * 360 / turn;
      if (margin < out.phase) out.phase = margin;
      out.crossover = w_before * std::pow(w / w_before, share) / turn;
    }
    if (k > 0 && before > -std::numbers::pi && phase <= -std::numbers::pi) {
      const double share = (before + std::numbers::pi) / (before - phase);
      const double gain = -20 * std::log10(size_before * std::pow(size / size_before, share));
      out.gain = std::min(out.gain, gain);
    }
    before = phase;
    size_before = size;
    w_before = w;
  }
  return out;
}

Spread spread_of(const Model& model, const WorkingPoint& at, const Gains& gains, Loop loop, double rate) {
  constexpr std::size_t draws = 200;
  Spread out{.least = margins_of(gains, linearise(model, at), loop, rate)};
  const std::vector<std::string> names = model.names();
  std::vector<std::size_t> uncertain;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (model.at(i).std_error.value_or(0) > 0 && !model.tie.contains(names[i])) uncertain.push_back(i);
  }
  if (uncertain.empty()) return out;
  std::mt19937_64 random(2011);  // the same answer whenever it is asked for
  for (; out.draws < draws; ++out.draws) {
    Model drawn = model;
    for (const std::size_t i : uncertain) {
      // Twelve even numbers: alike on every machine, as the library's normal numbers are not.
      double sum = -6;
      for (int k = 0; k < 12; ++k) sum += static_cast<double>(random() >> 11) * 0x1p-53;
      Parameter& p = drawn.at(i);
      const double value = p.value + sum * *p.std_error;
      p.value = p.min < p.max ? std::clamp(value, p.min, p.max) : value;
    }
    const Margins m = margins_of(gains, linearise(drawn, at), loop, rate);
    out.least.phase = std::min(out.least.phase, m.phase);
    out.least.gain = std::min(out.least.gain, m.gain);
  }
  return out;
}

FeedForward feed_forward_of(const Model& model, double top) {
  FeedForward out;
  for (const double share : {0.02, 0.1, 0.25, 0.5, 0.75, 1.0}) {
    const LinearMachine m = linearise(model, {.omega = share * top});
    out.omega.push_back(share * top);
    out.i_a.push_back(m.i_a);
    out.e_a.push_back(m.e_a);
  }
  return out;
}

}  // namespace emtb
