#include "tests/blind/same_machine.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "analysis/fit/calibrate.h"
#include "config/formula_effect.h"
#include "model/catalogue.h"
#include "tests/blind/case.h"
#include "tests/blind/draw.h"
#include "tests/blind/table.h"
#include "tests/blind/text.h"

namespace emtb::blind {
namespace {

constexpr double near = 0.1;  // of the ranges: readings are alike

/// The parameter that a case changes, as the plant has it.
void change(simulated::PlantParameters& plant, const std::string& parameter, double factor) {
  if (parameter == "R_a") plant.motor.R_a *= factor;
  if (parameter == "J") plant.motor.J *= factor;
  if (parameter == "B") plant.motor.B *= factor;
  if (parameter == "T_c") plant.friction.T_c *= factor;
  if (parameter == "K_b") plant.motor.K_b *= factor, plant.motor.K_m *= factor;
}

/// Half of the benches rub, as their model knows.
void give_friction(Bench& bench, Draw& draw) {
  if (!draw.chance(0.5)) return;
  const bool slow = bench.slow_meter;
  bench.plant.friction.T_c = (slow ? 0.04 : 0.0025) * draw.within(0.7, 1.4);
  const std::size_t effect = effect_index("coulomb_friction");
  if (bench.model.includes(effect)) return;
  bench.model.include(effect);
  bench.model.parameters_of(effect).front().value = bench.plant.friction.T_c * draw.within(0.8, 1.2);
}

std::vector<Run> record_all(const MachineCase& c, Draw& draw) {
  std::vector<Profile> profiles = c.bench.train;
  profiles.insert(profiles.end(), c.bench.held_out.begin(), c.bench.held_out.end());
  const std::uint64_t seed = draw.seed() >> 1U;
  std::vector<Run> runs;
  for (std::size_t r = 0; r < profiles.size(); ++r) {
    Bench here = c.bench;
    const bool own = c.kind == MachineKind::from_then ? r >= c.place : r == c.place;
    const double share = static_cast<double>(r) / static_cast<double>(profiles.size() - 1);
    if (c.kind == MachineKind::drift) change(here.plant, c.parameter, 1 + share * c.by);
    if (c.kind != MachineKind::drift && c.by != 0 && own) change(here.plant, c.parameter, 1 + c.by);
    if (c.torque != 0 && own) {
      const auto given = here.plant.hidden_torque;
      const double from = c.from_s, to = c.to_s, torque = c.torque;
      here.plant.hidden_torque = [=](double omega, double theta, double t) {
        return (given ? given(omega, theta, t) : 0) - (t > from && t < to ? torque : 0);
      };
    }
    runs.push_back(record(here, profiles[r], seed + r));
  }
  return runs;
}

double range_of(const std::vector<Run>& runs, Signal signal) {
  double most = 0;
  for (const Run& run : runs) {
    for (const double v : run.at(signal).value) most = std::max(most, std::abs(v));
  }
  return most;
}

/// By how much a disturbance moves what is read: two recordings with the same noise, with it and without.
double squares_between(const MachineCase& c, const Run& with, const Run& without) {
  double most = 0;
  for (const auto& channel : c.bench.channels) {
    if (channel.signal == Signal::e_a) continue;
    const double sigma = std::hypot(channel.noise, channel.lsb() / std::sqrt(12));
    const double independent = (1 - channel.correlation) / (1 + channel.correlation);
    double squares = 0;
    for (std::size_t k = 0; k < with.at(channel.signal).value.size(); ++k) {
      squares += std::pow((with.at(channel.signal).value[k] - without.at(channel.signal).value[k]) / sigma, 2);
    }
    most = std::max(most, independent * squares);
  }
  return most;
}

/// Were as many readings elsewhere taken at like speed and reference?
bool recurs(const MachineCase& c, const std::vector<Run>& undisturbed) {
  const double speed = near * range_of(undisturbed, Signal::omega),
               reference = near * range_of(undisturbed, Signal::u_ref);
  const Run& own = undisturbed[c.place];
  double within = 0, like = 0, omega = 0, u_ref = 0;
  const auto inside = [&](double t) { return t > c.from_s && t < c.to_s; };
  for (std::size_t k = 0; k < own.at(Signal::omega).t.size(); ++k) {
    if (!inside(own.at(Signal::omega).t[k])) continue;
    within += 1;
    omega += own.at(Signal::omega).value[k];
    u_ref += own.at(Signal::u_ref).value[k];
  }
  if (within == 0) return false;
  for (std::size_t r = 0; r < undisturbed.size(); ++r) {
    const Series &w = undisturbed[r].at(Signal::omega), &u = undisturbed[r].at(Signal::u_ref);
    for (std::size_t k = 0; k < std::min(w.t.size(), u.t.size()); ++k) {
      if (r == c.place && inside(w.t[k])) continue;
      if (std::abs(w.value[k] - omega / within) < speed && std::abs(u.value[k] - u_ref / within) < reference) like += 1;
    }
  }
  return like >= within;
}

void disturb(MachineCase& c, std::size_t runs, Draw& draw) {
  c.place = draw.below(runs);
  MachineCase plain = c;
  const std::uint64_t seed = draw.seed();
  Draw first(seed), second(seed);
  const std::vector<Run> before = record_all(plain, first);
  double seconds = 0;
  for (const Run& run : before) seconds += run.duration();
  const double lasts = std::min(0.3 * before[c.place].duration(), seconds * draw.within(0.005, 0.03));
  c.from_s = draw.within(0.1, 0.85) * (before[c.place].duration() - lasts);
  c.to_s = c.from_s + lasts;
  const auto& motor = c.bench.plant.motor;
  const double stall = motor.K_m * c.bench.plant.driver.gain * range_of(before, Signal::u_ref) / motor.R_a;
  c.torque = draw.sign() * draw.log_within(0.01, 0.2) * stall;
  const std::vector<Run> after = record_all(c, second);
  c.squares = squares_between(c, after[c.place], before[c.place]);
  c.recurs = recurs(c, before);
}

/// The parameter of one run alone, the others as they are: value and standard error.
std::pair<double, double> alone(std::span<const Record> run, Model model, std::size_t place) {
  for (std::size_t i = 0; i < model.names().size(); ++i) model.at(i).fixed = i != place;
  const Calibration c = calibrate(run, model, {.extra_starts = 0, .max_iterations = 20});
  return {c.model.at(place).value, c.model.at(place).std_error.value_or(1e300)};
}

/// Does the parameter of the run that is known to be another one differ by more than 3 sqrt(se^2 + between-run
/// variance of the others) and 3 %, with all known but its size?
bool visible_to_oracle(const MachineCase& c, const Model& fitted, const std::string& parameter) {
  std::vector<Run> all = c.train;
  all.insert(all.end(), c.held_out.begin(), c.held_out.end());
  const Dataset data = prepare(all, {}, c.bench.model);
  const auto names = fitted.names();
  const auto place = static_cast<std::size_t>(std::ranges::find(names, parameter) - names.begin());
  if (place == names.size() || fitted.at(place).fixed) return false;
  std::vector<Record> rest, own;
  for (std::size_t r = 0; r < data.train.size(); ++r) {
    const bool other = c.kind == MachineKind::from_then ? r >= c.place : r == c.place;
    (other ? own : rest).push_back(data.train[r]);
  }
  const Model others = calibrate(rest, fitted, {.extra_starts = 0, .with_covariance = false}).model;
  const double from = others.at(place).value;
  double between = 0;
  for (const Record& r : rest) between += std::pow(alone({&r, 1}, others, place).first - from, 2);
  between /= static_cast<double>(rest.size() - 1);
  const auto [value, error] = alone(own, others, place);
  return std::abs(value - from) > std::max(3 * std::sqrt(error * error + between), 0.03 * std::abs(from));
}

}  // namespace

std::string_view name_of(MachineKind kind) noexcept {
  constexpr std::array<std::string_view, 6> names{"healthy", "lacking", "changed", "from_then", "drift", "disturbed"};
  return names[static_cast<std::size_t>(kind)];
}

MachineCase make_machine_case(MachineKind kind, std::size_t number, std::uint64_t seed) {
  const bool lacking = kind == MachineKind::lacking;
  Case drawn = make_case(lacking ? CaseKind::single : CaseKind::healthy, number, seed, Setting::brief);
  MachineCase c;
  c.id = std::string(name_of(kind)) + ":" + std::to_string(number);
  c.kind = kind;
  c.bench = std::move(drawn.bench);
  Draw draw(seed * 1'000'003 + 7919 * number + static_cast<std::uint64_t>(kind));
  if (!lacking) give_friction(c.bench, draw);
  const std::size_t runs = c.bench.train.size() + c.bench.held_out.size();
  if (kind == MachineKind::changed || kind == MachineKind::from_then || kind == MachineKind::drift) {
    std::vector<std::string> able{"R_a", "K_b", "B", "J"};
    if (c.bench.plant.friction.T_c > 0) able.emplace_back("T_c");
    c.parameter = able[draw.below(able.size())];
    c.by = draw.sign() * draw.log_within(0.05, 0.3);
    c.place = kind == MachineKind::changed ? draw.below(runs) : 2 + draw.below(runs - 3);
  }
  if (kind == MachineKind::disturbed) disturb(c, runs, draw);
  std::vector<Run> all = record_all(c, draw);
  c.run = all[c.place].name;
  const auto behind = all.begin() + static_cast<std::ptrdiff_t>(c.bench.train.size());
  c.held_out.assign(behind, all.end());
  all.erase(behind, all.end());
  c.train = std::move(all);
  return c;
}

MachineAnswer ask(const MachineCase& c) {
  const DiscoverOptions options{
      .read = [](const FormulaText& t) { return read_formula(YamlMap::parse(t.yaml(), "a law"), t.id); },
      .progress = {}};
  const auto start = std::chrono::steady_clock::now();
  const Discovery d = discover(c.train, c.held_out, c.bench.model, options);
  MachineAnswer a;
  a.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  a.law_offered = d.law.has_value();
  a.change_named = !d.changed.empty();
  a.disturbance_named = !d.disturbances.empty();
  // As the model calls it: K_b stands for both where they are tied; T_c is an effect's.
  std::vector<std::string> right{c.parameter};
  if (c.parameter == "K_b") right.emplace_back("K_m");
  if (c.parameter == "T_c") right.emplace_back("coulomb_friction.T_c");
  for (const Changed& x : d.changed) {
    const bool how = c.kind == MachineKind::changed ? x.how == ChangeOf::one_run
                     : c.kind == MachineKind::from_then
                         ? x.how == ChangeOf::from_here_on || (x.how == ChangeOf::one_run && c.place == 5)
                         : x.how == ChangeOf::drift;
    const bool it =
        how && (c.kind == MachineKind::drift || x.run == c.run) && std::ranges::find(right, x.parameter) != right.end();
    a.found = a.found || it;
    a.otherwise = a.otherwise || !it;
    a.said += " " + x.parameter + " of " + x.run + " " + rounded(x.from, 6) + "->" + rounded(x.to, 6) + " (" +
              rounded(x.nats, 1) + " nats)";
  }
  for (const Disturbance& x : d.disturbances) {
    const bool it = c.torque != 0 && x.run == c.run && x.from_s < c.to_s && x.to_s > c.from_s;
    a.found = a.found || it;
    a.otherwise = a.otherwise || !it;
    a.said += " " + x.run + " " + rounded(x.from_s, 2) + ":" + rounded(x.to_s, 2) + " " + rounded(x.torque, 5) + " N m";
  }
  if (c.kind == MachineKind::disturbed) {
    constexpr double clear = 50;  // seven standard errors: it might have been anywhere
    a.visible = c.squares > clear && c.recurs;
  } else if (!c.parameter.empty()) {
    a.visible =
        c.kind == MachineKind::drift || visible_to_oracle(c, d.fitted, right.back() == "K_m" ? "K_b" : right.back());
  }
  return a;
}

std::string counted_with_interval(std::size_t hits, std::size_t all) {
  if (all == 0) return "0 of 0";
  const Interval interval = wilson({hits, all});
  const auto percent = [](double x) { return std::to_string(std::lround(100 * std::clamp(x, 0.0, 1.0))); };
  return std::to_string(hits) + " of " + std::to_string(all) + " (" + percent(interval.low) + " to " +
         percent(interval.high) + " %)";
}

}  // namespace emtb::blind
