#include "tests/blind/case.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/diagnose/compare.h"
#include "analysis/fit/calibrate.h"
#include "hal/error.h"
#include "model/catalogue.h"
#include "tests/blind/text.h"

namespace emtb::blind {
namespace {

constexpr double visible = 1.2, glaring = 5;  // held-out error of the given model, in units of the true sigma

bool library_has(std::string_view id) {
  return std::ranges::find(effect_catalogue(), id, &EffectInfo::id) != effect_catalogue().end();
}

/// What cases of a kind are about. Pairs need sizes: what is there or not would drown its partner.
std::vector<const Hidden*> subjects(CaseKind kind) {
  std::vector<const Hidden*> list;
  for (const Hidden& h : everything_hidden()) {
    if (h.outside == (kind == CaseKind::outside) && (h.sized || kind != CaseKind::pair)) list.push_back(&h);
  }
  return list;
}

Parameter& parameter(Model& model, std::string_view symbol) {
  return *std::ranges::find(model.base, symbol, &Parameter::symbol);
}

/// 200 to 250 s of experiments: what a careful person records in an afternoon.
void plan_experiments(Bench& bench, BenchKind kind, Draw& draw) {
  const std::uint64_t seed = draw.seed();
  if (kind == BenchKind::slow) {
    const std::vector<double> levels{1, 3, 5, 6, 4, 2};
    bench.train = {step("step_low", draw.within(1.5, 2.5), 1, 10, 8), step("step_high", 6, 1, 14, 12),
                   ramp("ramp", 6, 0.5, 1, 3, 3), random_steps("random", 0.5, 6, 1.5, 5, 1, 45, 8, seed)};
    bench.held_out = {step("step_mid", draw.within(3.5, 4.5), 1, 12, 10), staircase("staircase", levels, 1, 5, 8)};
  } else {
    const std::vector<double> levels{1, 4, 2, -1, -4, -2};
    bench.train = {step("step_low", draw.within(1.5, 2.5), 1, 12, 5), step("step_high", -5, 1, 14, 5),
                   ramp("ramp", 5, 0.5, 1, 5, 4), random_steps("random", -3.5, 3.5, 0.05, 3, 1, 70, 5, seed)};
    bench.held_out = {step("step_mid", draw.within(3.5, 4.5), 1, 14, 5), staircase("staircase", levels, 1, 5, 6)};
  }
}

/// A bench as it stands in some laboratory, with nothing hidden in it yet.
Case draw_bench(BenchKind kind, Setting setting, Draw& draw) {
  Case c;
  c.bench_kind = kind;
  c.bench = kind == BenchKind::slow ? slow_bench() : fast_bench();
  Bench& bench = c.bench;
  const auto note = [&c](const std::string& what) { c.nuisance += (c.nuisance.empty() ? "" : ", ") + what; };

  auto& motor = bench.plant.motor;
  motor.R_a *= draw.within(0.7, 1.3);
  motor.K_b *= draw.within(0.8, 1.3);
  motor.B *= draw.within(0.7, 1.3);
  motor.J *= draw.within(0.7, 1.3);
  motor.K_m = motor.K_b;
  bench.plant.friction.law = draw.chance(0.5) ? simulated::FrictionLaw::bristle : simulated::FrictionLaw::hard;
  bench.plant.laws = draw.chance(0.4) ? simulated::Laws::usual : simulated::Laws::other;
  if (bench.plant.laws == simulated::Laws::usual) note("usual laws");
  const bool easy = setting == Setting::easy;
  if (!easy && draw.chance(0.4)) {
    motor.K_m *= draw.within(0.75, 1);
    // Nobody who knows that K_m is another constant ties it; the slope of torque over current gave it to 1 %.
    Parameter& K_m = parameter(bench.model, "K_m");
    bench.model.tie.clear();
    K_m.value = motor.K_m * (1 + 0.01 * draw.within(-1, 1));
    K_m.prior = Prior{.value = K_m.value, .std = 0.01 * K_m.value};
    note("K_m " + rounded(motor.K_m / motor.K_b, 2) + " K_b");
  }
  if (!easy && draw.chance(0.15)) {
    auto& driver = bench.plant.driver;
    driver.gain *= 1 + 0.02 * draw.within(-1, 1);
    driver.rise *= 1 + 0.02 * draw.within(-1, 1);
    driver.fall *= 1 + 0.02 * draw.within(-1, 1);
    c.tolerated = {"driver_gain_error", "driver_slew", "driver_saturation"};
    note("driver off by 2 %");
  }

  // Instruments
  const double rho = easy || draw.chance(0.4) ? 0 : draw.within(0, 0.97);
  if (rho > 0) note("rho " + rounded(rho, 2));
  for (auto& channel : bench.channels) {
    channel.noise *= draw.log_within(0.6, 2);
    // A divider and a shunt are filtered otherwise than a tacho.
    if (channel.signal == Signal::omega || channel.signal == Signal::torque || draw.chance(0.5))
      channel.correlation = rho;
    if (kind == BenchKind::slow && channel.signal == Signal::omega) channel.low = -260, channel.high = 260;
    if (kind == BenchKind::fast && channel.signal == Signal::omega)
      channel.low = -900, channel.high = 900, channel.bits = 13;
    if (kind == BenchKind::fast && channel.signal == Signal::i_a)
      channel.low = -60, channel.high = 60, channel.bits = 16;
  }
  bench.meter.resolution = draw.one_of({0.001, 0.002, 0.005, 0.01});
  bench.meter.period = bench.meter.window = draw.one_of({0.2, 0.4, 0.5, 1});
  if (easy) return c;
  bench.rate = kind == BenchKind::slow ? draw.one_of({250, 500, 1000}) : 1000;
  const auto lose = [&](Signal signal) {
    std::erase_if(bench.channels, [&](const auto& channel) { return channel.signal == signal; });
  };
  if (draw.chance(0.25)) lose(Signal::torque), note("no torque");
  if (draw.chance(0.15)) lose(Signal::e_a), note("no e_a");
  if (kind == BenchKind::fast && draw.chance(0.15)) {
    lose(Signal::i_a);
    bench.slow_meter = true;
    note("slow meter");
  }
  if (setting == Setting::laboratory) plan_experiments(bench, kind, draw);
  return c;
}

/// Puts an effect into the plant and into the model that the user starts from.
void give(Case& c, std::string_view id, Draw& draw) {
  const bool slow = c.bench_kind == BenchKind::slow;
  Bench& bench = c.bench;
  std::vector<double> values;
  if (id == "coulomb_friction") {
    values = {bench.plant.friction.T_c = (slow ? 0.04 : 0.0025) * draw.within(0.7, 1.4)};
  } else if (id == "eddy_brake") {
    auto& load = bench.plant.load;
    load.eddy_torque = (slow ? 0.3 : 0.04) * draw.within(0.7, 1.3);
    load.eddy_omega = (slow ? 70 : 250) * draw.within(0.8, 1.2);
    values = {load.eddy_torque, load.eddy_omega};
  } else if (id == "shaft_compliance") {
    const auto parameters = hidden(id).hide(bench, c.bench_kind, 0.6, draw);
    for (const TrueParameter& p : parameters) values.push_back(p.value);
  }
  c.given.emplace_back(id);
  if (!library_has(id)) return;
  const std::size_t effect = effect_index(id);
  bench.model.include(effect);
  auto& included = *std::ranges::find(bench.model.effects, effect, &IncludedEffect::effect);
  for (std::size_t i = 0; i < std::min(values.size(), included.parameters.size()); ++i) {
    included.parameters[i].value = values[i] * draw.within(0.8, 1.2);
  }
}

/// The model that knows the plant's constants, but for what is hidden: where a fit of the given model starts.
Model with_true_constants(const Case& c) {
  Model model = c.bench.model;
  const auto& motor = c.bench.plant.motor;
  parameter(model, "R_a").value = motor.R_a;
  parameter(model, "K_b").value = motor.K_b;
  if (model.tie.empty()) parameter(model, "K_m").value = motor.K_m;
  parameter(model, "B").value = motor.B * motor.K_b / motor.K_m;
  parameter(model, "J").value = motor.J;
  if (model.driver && !c.tolerated.empty()) {
    const auto& driver = c.bench.plant.driver;
    model.driver->gain = driver.gain;
    model.driver->rise = driver.rise;
    model.driver->fall = driver.fall;
  }
  model.noise = true_sigma(c.bench);
  return model;
}

/// Held-out error of the given model, fitted, on a bench that hides something.
double linear_error_of(const Model& start, const Bench& bench, std::uint64_t seed, std::vector<Run>* train = nullptr,
                       std::vector<Run>* held_out = nullptr) {
  std::vector<Run> fitted_to = record(bench, bench.train, seed);
  std::vector<Run> judged_on = record(bench, bench.held_out, seed + 1000);
  const Dataset data = prepare(fitted_to, judged_on, start);
  const CalibrationOptions quick{.extra_starts = 0, .max_iterations = 30, .tolerance = 1e-5, .with_covariance = false};
  const Model fitted = calibrate(data.train, start, quick).model;
  const double error = error_of(mean_squares(residuals(data.held_out, fitted, fitted.values(), {})));
  if (train != nullptr) *train = std::move(fitted_to);
  if (held_out != nullptr) *held_out = std::move(judged_on);
  return error;
}

/// The size at which the given model errs by about `wanted`; nothing where no plausible size does so.
std::optional<double> size_for(const Hidden& what, const Case& c, double wanted, const Draw& shapes,
                               std::uint64_t seed) {
  const Model start = with_true_constants(c);
  const auto error_at = [&](double size) {
    Bench bench = c.bench;
    what.hide(bench, c.bench_kind, size, shapes);
    return linear_error_of(start, bench, seed) / c.floor;
  };
  if (!what.sized) return error_at(1) >= visible ? std::optional(1.0) : std::nullopt;
  double size = 1, below = 0, above = 0;
  for (int n = 0; n < 10; ++n) {
    const double error = error_at(size);
    if (std::abs(std::log(error / wanted)) < 0.15) return size;
    if (error < wanted && size >= what.largest) return error >= visible ? std::optional(size) : std::nullopt;
    (error < wanted ? below : above) = size;
    // The excess grows with the square of a small amplitude; bracketed, by halves of the logarithm.
    const double excess = std::max(error * error - 1, 0.02);
    double next = size * std::clamp(std::sqrt((wanted * wanted - 1) / excess), 0.1, 6.0);
    if (below > 0 && above > 0 && (next <= below || next >= above || n > 3)) next = std::sqrt(below * above);
    size = std::min(next, what.largest);
    if (below > 0 && above > 0 && above / below < 1.02) break;
  }
  // A cliff (stiction that just holds): no size gives what was wanted; either side of it will do if it is within.
  for (const double side : {above, below}) {
    if (side <= 0) continue;
    const double error = error_at(side);
    if (error >= visible && error <= glaring) return side;
  }
  return std::nullopt;
}

/// How much of what is measured changes with one of the hidden things: RMS over the held-out runs in units of the true
/// sigma, the largest of all signals. The same seed gives the same noise, so that only the effect is left.
double presence(const Case& c, const std::vector<Run>& with, const Bench& without, std::uint64_t seed) {
  const std::vector<Run> other = record(without, without.held_out, seed + 1000);
  double largest = 0;
  for (const auto& [signal, sigma] : true_sigma(c.bench)) {
    double squares = 0, count = 0;
    for (std::size_t r = 0; r < with.size(); ++r) {
      const auto &a = with[r].at(signal).value, &b = other[r].at(signal).value;
      for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k) squares += std::pow((a[k] - b[k]) / sigma, 2);
      count += static_cast<double>(std::min(a.size(), b.size()));
    }
    largest = std::max(largest, std::sqrt(squares / count));
  }
  return largest;
}

/// Hides one thing after another in a bench; false where the bench cannot show one of them.
bool hide(Case& c, const std::vector<const Hidden*>& what, Draw& draw) {
  for (const Hidden* h : what) {
    // Half of those effects that need a load to show it will do with the currents of acceleration on the fast bench.
    const bool load_needed = h->given == "eddy_brake" && c.bench_kind == BenchKind::fast && !h->needs_gauge;
    const bool skip = load_needed && draw.chance(0.5);
    if (!h->given.empty() && !skip && std::ranges::find(c.given, h->given) == c.given.end()) give(c, h->given, draw);
  }
  const std::uint64_t seed = draw.seed() >> 1U;
  const bool usual = c.bench.plant.laws == simulated::Laws::usual;
  c.floor = linear_error_of(with_true_constants(c), c.bench, seed);
  std::vector<Draw> shapes;
  for (const Hidden* h : what) {
    shapes.emplace_back(draw.seed());
    const auto size = size_for(*h, c, draw.log_within(1.4, 4.2), shapes.back(), seed);
    if (!size) return false;
    c.truths.push_back({std::string(h->id), *size, {}, right_answers(h->id, c.bench, c.bench_kind)});
  }
  const Bench plain = c.bench;
  for (std::size_t i = 0; i < what.size(); ++i) {
    auto parameters = what[i]->hide(c.bench, c.bench_kind, c.truths[i].size, shapes[i]);
    if (usual) c.truths[i].parameters = std::move(parameters);
  }
  c.linear_error = linear_error_of(with_true_constants(c), c.bench, seed, &c.train, &c.held_out) / c.floor;
  // One may hide the other: a tacho that lags smooths its own ripple.
  for (std::size_t left_out = 0; what.size() > 1 && left_out < what.size(); ++left_out) {
    Bench without = plain;
    for (std::size_t i = 0; i < what.size(); ++i) {
      if (i != left_out) what[i]->hide(without, c.bench_kind, c.truths[i].size, shapes[i]);
    }
    if (presence(c, c.held_out, without, seed) < 0.5 * c.floor) return false;
  }
  for (const auto* ids : {&c.given, &c.tolerated}) {
    for (const std::string& id : *ids) {
      if (!library_has(id)) c.lacking.push_back(id);
    }
  }
  for (const Truth& t : c.truths) {
    if (!hidden(t.id).outside && !library_has(t.id)) c.lacking.push_back(t.id);
    std::erase(c.tolerated, t.id);
  }
  return true;
}

bool possible_on(const Hidden& what, const Case& c) {
  const auto measured = [&](Signal signal) {
    return std::ranges::find(c.bench.channels, signal, &simulated::DaqChannel::signal) != c.bench.channels.end();
  };
  if (!(c.bench_kind == BenchKind::slow ? what.slow : what.fast)) return false;
  // What the nuisance already did to the driver cannot be hidden once more.
  if (std::ranges::find(c.tolerated, what.id) != c.tolerated.end()) return false;
  return (!what.needs_gauge || measured(Signal::torque)) && (!what.needs_voltage || measured(Signal::e_a));
}

bool go_together(const Hidden& a, const Hidden& b) {
  return a.id != b.id && a.given != b.id && b.given != a.id && ((a.slow && b.slow) || (a.fast && b.fast));
}

/// Where the reference has one sign, a dead zone is an offset: beside a driver whose offset is unknown, it is nothing.
bool is_a_part_of_another(const std::vector<const Hidden*>& what, const Case& c) {
  const auto hides = [&](std::string_view id) { return std::ranges::find(what, id, &Hidden::id) != what.end(); };
  const bool offset_unknown = hides("driver_gain_error") || !c.tolerated.empty();
  return c.bench_kind == BenchKind::slow && hides("driver_dead_zone") && offset_unknown;
}

const Hidden& partner_of(const Hidden& first, std::size_t number) {
  const auto list = subjects(CaseKind::pair);
  std::size_t n = 7 * number + 5;
  while (!go_together(first, *list[n % list.size()])) ++n;
  return *list[n % list.size()];
}

}  // namespace

std::string_view name_of(CaseKind kind) noexcept {
  constexpr std::array<std::string_view, 4> names{"healthy", "single", "pair", "outside"};
  return names[static_cast<std::size_t>(kind)];
}

std::optional<CaseKind> kind_named(std::string_view name) noexcept {
  for (const CaseKind kind : {CaseKind::healthy, CaseKind::single, CaseKind::pair, CaseKind::outside}) {
    if (name_of(kind) == name) return kind;
  }
  return std::nullopt;
}

std::vector<std::string_view> subjects_of(CaseKind kind, std::size_t number) {
  if (kind == CaseKind::healthy) return {};
  const auto list = subjects(kind);
  const Hidden& first = *list[number % list.size()];
  if (kind != CaseKind::pair) return {first.id};
  return {first.id, partner_of(first, number).id};
}

Case make_case(CaseKind kind, std::size_t number, std::uint64_t base_seed, Setting setting) {
  const std::string id = std::string(name_of(kind)) + ":" + std::to_string(number);
  std::vector<const Hidden*> what;
  for (const std::string_view subject : subjects_of(kind, number)) what.push_back(&hidden(subject));
  const std::uint64_t seed =
      SplitMix64(base_seed * 1'000'003 + static_cast<std::uint64_t>(kind) * 100'000 + number).next();
  for (int attempt = 0; attempt < 20; ++attempt) {
    Draw draw(seed + static_cast<std::uint64_t>(attempt));
    Case c = draw_bench(draw.chance(0.5) ? BenchKind::slow : BenchKind::fast, setting, draw);
    if (!std::ranges::all_of(what, [&](const Hidden* h) { return possible_on(*h, c); })) continue;
    if (is_a_part_of_another(what, c)) continue;
    if (!hide(c, what, draw)) continue;
    c.id = id;
    c.kind = kind;
    c.seed = seed + static_cast<std::uint64_t>(attempt);
    return c;
  }
  throw ModelError(id + ": no bench shows " + std::string(what.front()->id) + " at a plausible size");
}

std::map<Signal, double> true_sigma(const Bench& bench) {
  std::map<Signal, double> sigma;
  for (const auto& channel : bench.channels) {
    sigma[channel.signal] = std::hypot(channel.noise, channel.lsb() / std::sqrt(12));
  }
  if (bench.slow_meter) {
    sigma[Signal::i_a] = std::hypot(bench.meter.noise, bench.meter.resolution / std::sqrt(12));
  }
  return sigma;
}

std::map<Signal, double> true_mean_squares(const Case& c, const Model& model) {
  Model weighed = c.bench.model;
  weighed.noise = true_sigma(c.bench);
  const Dataset data = prepare({}, c.held_out, weighed);  // weights as for the given model, whatever was found
  return mean_squares(residuals(data.held_out, model, model.values(), {}));
}

}  // namespace emtb::blind
