#include "analysis/record/record.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <vector>

#include "analysis/numerics/even_series.h"
#include "analysis/record/angle_noise.h"
#include "analysis/record/first_states.h"
#include "analysis/record/interpolated.h"
#include "analysis/record/reference_row.h"
#include "analysis/record/repeats.h"
#include "analysis/record/shaft_angle.h"
#include "hal/error.h"

namespace emtb {
namespace {

/// The input, and what else is set from outside.
void set_inputs(ObservedRun& record, const Run& run, const Model& model) {
  Excitation& x = record.excitation;
  const Series& grid = run.at(model.input);
  if (grid.t.size() < 10) throw ModelError(run.name + " is too short: " + std::to_string(grid.t.size()) + " samples");
  x.t = grid.t;
  (model.input == Signal::u_ref ? x.u_ref : model.input == Signal::e_a ? x.e_a : x.i_a) = grid.value;
  if (run.has(Signal::armature_open)) {
    for (const double open : on_grid(run.at(Signal::armature_open), x.t, run.name + ": armature_open")) {
      x.armature_open.push_back(open > 0.5);
    }
  }
  if (run.has(Signal::temperature)) {
    x.temperature = on_grid(run.at(Signal::temperature), x.t, run.name + ": temperature_degC");
  }
}

void add(ObservedRun& record, Observation o) {
  if (o.size() == 0) return;
  for (const Observation& before : record.observations) {  // most are read at the same times
    if (o.last.share(before.last)) break;
  }
  o.first.share(o.last);
  o.begin.share(o.end);
  record.observations.push_back(std::move(o));
}

/// Is it a log of events, in which each instrument has rows of its own? Then there is none that is read in nearly all
/// of them, and few rows without a reading.
bool is_of_events(const Run& run, std::span<const double> grid) {
  constexpr double few = 0.2, nearly_all = 0.9;
  std::size_t most = 0, sum = 0;
  for (const Signal signal : {Signal::omega, Signal::theta, Signal::i_a, Signal::e_a, Signal::torque}) {
    if (!run.has(signal)) continue;
    most = std::max(most, run.at(signal).t.size());
    sum += run.at(signal).t.size();
  }
  const auto share = [&](std::size_t count) { return static_cast<double>(count) / static_cast<double>(grid.size()); };
  return share(most) < nearly_all && share(sum) > 1 - few;
}

/// Does an instrument give so few readings that each is a mean over the time between them? In a log of events the
/// instruments that are read often are no meters, though they have a part of the rows each.
bool is_a_meter(const Run& run, Signal signal, std::span<const double> grid) {
  const std::size_t rows_each = is_of_events(run, grid) ? 10 : 2;
  return rows_each * run.at(signal).t.size() < grid.size();
}

/// A signal as its instrument read it: an instant, or where readings are few, means. A mean over less than a row is an
/// instant, as late as its half, which the timing tells. What a logger repeats from row to row counts once, and what
/// somebody put between two readings is none.
Observation read(const Run& run, Signal signal, std::span<const double> grid) {
  const Series series = without_straight_rows(run.at(signal));
  constexpr double whole = 0.99;  // rows, but for rounding
  const bool averages = series.window > 0 && series.window >= whole * mean_interval(grid);
  const bool meter = is_a_meter(run, signal, grid);
  return observe(meter ? series : readings_of(series), signal, grid, averages || meter);
}

/// The terminal voltage. While the armature is open it is the driver's on one side of the switch and what the motor
/// induces on the other, and nobody says which is read.
Observation terminal_voltage(const Run& run, const Excitation& x) {
  Observation o = read(run, Signal::e_a, x.t);
  if (x.armature_open.empty()) return o;
  const auto is_open = [&](std::size_t i) {
    const std::size_t from = o.first[i] > 0 ? o.first[i] - 1 : 0;  // where it is switched, too
    return std::ranges::any_of(std::span(x.armature_open).subspan(from, o.last[i] + 1 - from), std::identity{});
  };
  std::vector<double> begin, end, value;
  std::vector<std::uint32_t> first, last;
  for (std::size_t i = 0; i < o.size(); ++i) {
    if (is_open(i)) continue;
    begin.push_back(o.begin[i]);
    end.push_back(o.end[i]);
    value.push_back(o.value[i]);
    first.push_back(o.first[i]);
    last.push_back(o.last[i]);
  }
  o.begin = std::move(begin);
  o.end = std::move(end);
  o.value = std::move(value);
  o.first = std::move(first);
  o.last = std::move(last);
  return o;
}

/// The speed, and the angle that judges it or stands for it.
void observe_motion(ObservedRun& record, const Run& run, const Logging& logging) {
  Excitation& x = record.excitation;
  if (run.has(Signal::omega)) {
    add(record, read(run, Signal::omega, x.t));
    if (run.has(Signal::theta)) add(record, angle_increments(run.at(Signal::theta), x.t, logging.angle_noise));
  } else if (run.has(Signal::theta)) {
    add(record, speed_of_encoder(run.at(Signal::theta), x.t, logging.angle_noise));
  }
  MeasuredAngle measured = measured_angle(run, x.t, logging.order);
  x.angle = std::move(measured.angle);
  if (run.has(Signal::theta)) x.angle.share(run.at(Signal::theta).value);
  x.angle_integrated = measured.wanders;
}

/// The speed on the grid, straight between the middles of an encoder's slopes, and level beyond them.
std::vector<double> between_slopes(const Observation& slopes, std::span<const double> grid) {
  const auto middle = [&](std::size_t i) { return 0.5 * (slopes.begin[i] + slopes.end[i]); };
  std::vector<double> speed;
  speed.reserve(grid.size());
  std::size_t next = 0;
  for (const double t : grid) {
    while (next < slopes.size() && middle(next) < t) ++next;
    if (next == 0 || next == slopes.size()) {
      speed.push_back(slopes.value[next == 0 ? 0 : next - 1]);
      continue;
    }
    const double share = (t - middle(next - 1)) / (middle(next) - middle(next - 1));
    speed.push_back(std::lerp(slopes.value[next - 1], slopes.value[next], share));
  }
  return speed;
}

/// The torque, as a reading and as what loads the shaft.
void observe_load(ObservedRun& record, const Run& run) {
  Excitation& x = record.excitation;
  add(record, read(run, Signal::torque, x.t));
  const SteadySpeed speed = run.has(Signal::omega) ? steady_speed(run, x.t) : unknown_speed(x.t);
  MeasuredInput load =
      measured_load(record.name, straight_between_updates(run.at(Signal::torque)), x.t, x.angle, speed.reach);
  if (load.value.empty()) return;
  x.load = std::move(load.value);
  record.load_noise = std::move(load.noise);
  record.measured_load = true;
  // What load effects see: noise that enters the predicted torque looks like a gauge that is too quick.
  if (run.has(Signal::omega)) {
    x.omega = speed.quiet();
  } else if (const Observation* slopes = record.find(Signal::omega)) {
    x.omega = between_slopes(*slopes, x.t);
  }
}

/// The terminal voltage as what drives the motor.
/// @param late [samples] by which it is read behind the others
void drive_by_voltage(ObservedRun& record, const Series& e_a, const Model& model, double late) {
  Excitation& x = record.excitation;
  const double of_its_window = 0.5 * e_a.window / mean_interval(x.t);  // a mean stands for the middle of it
  MeasuredVoltage voltage = measured_voltage(record.name, e_a, x, model, std::max(late, of_its_window));
  x.e_a = std::move(voltage.value);
  x.e_a_bulge = std::move(voltage.bulge);
  record.voltage_noise = std::move(voltage.noise);
  record.measured_voltage = true;
}

}  // namespace

void set_steps(Excitation& x, const Model& model) {
  // A step is exact for a linear motor under a steady voltage. At a tenth of the mechanical time constant what the
  // effects add at its middle is good to 1e-3; those with a time constant of their own need a fiftieth. Where a shaft
  // comes to rest within a step is known to a share of it: the longest of all keep that below what instruments see.
  const double time_constant = model.mechanical_time_constant();
  x.longest_step = std::clamp(time_constant / 10, 2e-4, 5e-2);
  x.quick_step = std::clamp(time_constant / 50, 2e-4, 2e-2);
}

const Observation* ObservedRun::find(Signal signal) const {
  const auto o = std::ranges::find(observations, signal, &Observation::signal);
  return o != observations.end() ? &*o : nullptr;
}

double ObservedRun::interval_of(const Observation& o) const {
  const std::vector<double>& t = excitation.t;
  return (t[o.last.back()] - t[o.last.front()]) / static_cast<double>(o.size() - 1);
}

ModelStructure ObservedRun::structure(const Model& model) const {
  ModelStructure s = model.structure();
  s.measured_voltage = measured_voltage;
  s.measured_load = measured_load;
  return s;
}

ObservedRun observe_run(const Run& run, const Model& model, Chaining chaining) {
  const std::span alone(&run, 1);
  return observe_run(run, model, chaining, {.order = ripple_order(alone), .angle_noise = angle_noise(model, alone)});
}

ObservedRun observe_run(const Run& run, const Model& model, Chaining chaining, const Logging& logging) {
  if (!run.has(model.input)) {
    throw ModelError(run.name + " has no " + std::string(info(model.input).column) + ", the input of model `" +
                     model.name + "`. Record it, map it with --map, or give the model another `input`");
  }
  ObservedRun record;
  record.name = run.name;
  set_inputs(record, run, model);
  record.excitation.acts_after = logging.acts_after;
  observe_motion(record, run, logging);
  if (run.has(Signal::i_a) && model.input != Signal::i_a) add(record, read(run, Signal::i_a, record.excitation.t));
  if (run.has(Signal::torque)) observe_load(record, run);
  const bool voltage_is_read = model.input == Signal::u_ref && run.has(Signal::e_a);
  if (voltage_is_read) add(record, terminal_voltage(run, record.excitation));
  record.measured_voltage = model.input == Signal::e_a;
  if (logging.voltage_hops) {
    MeasuredInput quiet = quiet_voltage(record.excitation.e_a, mean_interval(record.excitation.t));
    record.excitation.e_a = std::move(quiet.value);
    record.voltage_noise = std::move(quiet.noise);
  }
  if (record.observations.empty()) {
    throw ModelError(run.name + " holds nothing to compare the model with: add omega_rad_s, theta_rad or i_a_A");
  }
  record.excitation.initial = first_states(record, run, model);
  record.excitation.initial.field_on = run.field_on;
  if (chaining == Chaining::staged && drives_the_motor(run, model)) {
    drive_by_voltage(record, run.at(Signal::e_a), model, logging.voltage_late);
  }
  set_steps(record.excitation, model);
  return record;
}

}  // namespace emtb
