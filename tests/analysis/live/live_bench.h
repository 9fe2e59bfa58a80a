#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "analysis/live/estimator.h"
#include "config/bench.h"
#include "config/model.h"
#include "config/shipped.h"
#include "drivers/simulated/recording.h"
#include "experiment/profile.h"
#include "model/catalogue.h"

namespace emtb::live_bench {

/// A simulated bench as shipped, whose plant a test knows, and the model that follows it.
struct LiveBench {
  simulated::Setup setup;
  Model model;
  Profile staircase;                    ///< 60 s
  std::map<std::string, double> truth;  ///< of the model's parameters

  std::vector<Channel> channels() const {
    std::vector<Channel> all;
    for (const auto& c : setup.channels) {
      all.push_back({.signal = c.signal, .period = 1 / setup.rate, .window = 0, .lsb = c.lsb(), .source = "daq"});
    }
    if (setup.meter) {
      all.push_back({.signal = Signal::i_a,
                     .period = setup.meter->period,
                     .window = setup.meter->window,
                     .lsb = setup.meter->resolution,
                     .source = "meter"});
    }
    return all;
  }

  void colour_tacho(double rho) {
    for (auto& c : setup.channels) {
      if (c.signal == Signal::omega) c.correlation = rho;
    }
  }
};

inline LiveBench live_bench(const std::string& name, const std::string& model, const std::vector<double>& levels) {
  LiveBench bench{.setup = simulated::read_setup(read_bench(shipped("benches/" + name + ".yaml"))),
                  .model = read_model(shipped("models/" + model + ".yaml")),
                  .staircase = staircase("staircase", levels, 2, 58.0 / static_cast<double>(levels.size() + 1),
                                         58.0 / static_cast<double>(levels.size() + 1)),
                  .truth = {}};
  const auto& m = bench.setup.plant.motor;
  bench.truth = {{"R_a", m.R_a}, {"K_b", m.K_b}, {"B", m.B}, {"J", m.J}};
  return bench;
}

/// The paper's bench: one direction, 22.5 V/s, current by a 2.5 Hz meter, and the friction that the model has to have.
inline LiveBench slow_live_bench() {
  LiveBench bench = live_bench("fh2-simulated", "fh2", {1, 2, 3, 4, 5, 6, 4, 2});
  const std::size_t friction = effect_index("coulomb_friction");
  bench.model.include(friction);
  bench.truth["coulomb_friction.T_c"] = bench.setup.plant.friction.T_c;
  return bench;
}

/// The small servo: both directions, current on the card.
inline LiveBench fast_live_bench() {
  return live_bench("desk-simulated", "desk", {1, 3, 6, 4, 2, -1, -3, -6, -4, -2, 1});
}

/// What happens to a motor in mid run, and from when on it shows.
struct MotorChange {
  std::string name;                                         ///< of the parameter
  double size = 0;                                          ///< SI
  double visible = 0;                                       ///< [s]
  std::function<void(simulated::PlantParameters&)> become;  ///< of the plant
};

constexpr double changed_at = 65;  // [s] the motor runs at one speed
constexpr double stepped_at = 68;  // [s] the reference's next step

inline MotorChange hotter(const LiveBench& bench, double share) {
  const double size = share * bench.setup.plant.motor.R_a;
  return {"R_a", size, changed_at, [size](simulated::PlantParameters& p) { p.motor.R_a += size; }};
}
inline MotorChange heavier(const LiveBench& bench, double share) {
  const double size = share * bench.setup.plant.motor.J;
  return {"J", size, stepped_at, [size](simulated::PlantParameters& p) { p.motor.J += size; }};
}
/// @param torque [N m] that the gauge does not see
inline MotorChange rubbing(double torque) {
  return {"coulomb_friction.T_c", torque, changed_at,
          [torque](simulated::PlantParameters& p) { p.friction.T_c += torque; }};
}
/// @param torque [N m] that the gauge sees
inline MotorChange braked(double torque) {
  return {"load_torque.T_L", torque, changed_at, [torque](simulated::PlantParameters& p) { p.load.torque += torque; }};
}

/// The staircase, a level at which the motor changes, a step to another one.
inline Run changed_run(const LiveBench& bench, const MotorChange& change, std::uint64_t seed) {
  std::vector<Knot> knots(bench.staircase.knots().begin(), bench.staircase.knots().end());
  const double level = bench.setup.plant.driver.min < 0 ? -2 : 3;  // [V]
  const double end = bench.staircase.duration();
  for (const Knot& knot :
       {Knot{end, level}, Knot{stepped_at, level}, Knot{stepped_at, 1.7 * level}, Knot{stepped_at + 8, 1.7 * level}}) {
    knots.push_back(knot);
  }
  simulated::PlantParameters after = bench.setup.plant;
  change.become(after);
  const std::vector<simulated::Operation> operations{
      {changed_at, [&](simulated::Plant& plant) { plant.become(after); }}};
  return simulated::record(bench.setup, Profile("changed", knots), seed, operations);
}

/// A bench whose eddy brake is on from the beginning: 0.3 N m at 60 rad/s, or of the servo 0.05 N m at 200 rad/s.
inline LiveBench loaded(LiveBench bench) {
  const bool servo = bench.setup.plant.driver.min < 0;
  bench.setup.plant.load.eddy_torque = servo ? 0.05 : 0.3;
  bench.setup.plant.load.eddy_omega = servo ? 200 : 60;
  return bench;
}

/// Hands a recorded run to the estimator in the order in which the daemon's loop would: at each tick what was read,
/// then the reference.
/// @param see called before each reading: may change it; false: it is lost
template <class See>
void feed(LiveEstimator& estimator, const Run& run, const See& see) {
  estimator.start_run(run.field_on);
  std::map<Signal, std::size_t> next;
  const Series& ticks = run.at(Signal::u_ref);
  for (std::size_t k = 0; k < ticks.t.size(); ++k) {
    for (const auto& [signal, series] : run.signals) {
      if (signal == Signal::u_ref) continue;
      for (std::size_t& i = next[signal]; i < series.t.size() && series.t[i] <= ticks.t[k] + 1e-9; ++i) {
        double value = series.value[i];
        if (see(signal, series.t[i], value)) estimator.take(signal, series.t[i], value);
      }
    }
    double value = ticks.value[k];
    if (see(Signal::u_ref, ticks.t[k], value)) estimator.take(Signal::u_ref, ticks.t[k], value);
  }
}

inline void feed(LiveEstimator& estimator, const Run& run) {
  feed(estimator, run, [](Signal, double, double&) { return true; });
}

inline const LiveParameter& parameter(const LiveEstimates& e, const std::string& name) {
  for (const LiveParameter& p : e.parameters) {
    if (p.name == name) return p;
  }
  throw std::out_of_range(name);
}

/// How many standard errors an estimate is from the truth.
inline double in_errors(const LiveEstimates& e, const std::string& name, double truth) {
  const LiveParameter& p = parameter(e, name);
  return (p.value - truth) / p.std_error;
}

}  // namespace emtb::live_bench
