#include "analysis/diagnose/null_fit.h"

#include <algorithm>
#include <cmath>

#include "analysis/numerics/even_series.h"
#include "analysis/numerics/parallel.h"
#include "analysis/numerics/ringing.h"
#include "analysis/record/supply.h"
#include "model/catalogue.h"

namespace emtb {
namespace {

constexpr Eigen::Index readings_at_once = 2048;  // readings that are whitened: few enough for a cache

BaseResiduals with_autoregression(BaseResiduals base) {
  const Residuals& r = base.plain;
  const Eigen::Index n = r.value.size();
  const double squares = r.value.squaredNorm();
  if (n > 2 && squares > 0) {
    base.rho = std::clamp(r.value.head(n - 1).dot(r.value.tail(n - 1)) / squares, -0.9, 0.999);
  }
  double white = 0;
  for (Eigen::Index first = 0; first < n; first += readings_at_once) {
    white += base.left_white(first, std::min(readings_at_once, n - first)).squaredNorm();
  }
  base.innovation = std::max(1e-9, std::sqrt(white / static_cast<double>(std::max<Eigen::Index>(1, n))));
  return base;
}

void add_to(OwnSums& plain, OwnSums& white, const BaseResiduals& base) {
  const Eigen::VectorXd& left = base.plain.value;
  for (Eigen::Index first = 0; first < left.size(); first += readings_at_once) {
    const Eigen::Index count = std::min(readings_at_once, left.size() - first);
    plain.add(base.known(first, count), left.segment(first, count));
    white.add(base.known_white(first, count), base.left_white(first, count));
  }
}

/// The residuals of a record at a phase, its sensitivities never held with all their digits where they need not be.
std::vector<BaseResiduals> bases_of(const Record& record, const ModelStructure& structure,
                                    std::span<const double> values, std::span<const std::vector<std::size_t>> moved,
                                    const RotorPhase& phase) {
  std::vector<BaseResiduals> bases;
  if (!phase.at.empty() || moved.size() > 2 * derivatives_per_pass) {
    for (Residuals& r : residuals_at_phase(record, structure, values, moved, phase).residuals) {
      Eigen::MatrixXf sensitivity = r.sensitivity.cast<float>();
      r.sensitivity.resize(0, 0);
      bases.push_back({std::move(r), std::move(sensitivity)});
    }
    return bases;
  }
  for (const Observation& o : record.observations)
    bases.push_back({{0, o.signal, Eigen::VectorXd(static_cast<Eigen::Index>(o.size())), {}}, {}});
  visit_simulated_residuals(
      record, structure, values, moved,
      [&](std::size_t s, Eigen::Index first, const Eigen::VectorXd& value, const Eigen::MatrixXd& sensitivity) {
        BaseResiduals& base = bases[s];
        base.plain.value.segment(first, value.size()) = value;
        if (!base.informed()) {
          if (sensitivity.isZero(0)) return;  // no derivative yet, perhaps never
          base.sensitivity.setZero(base.plain.value.size(), sensitivity.cols());
        }
        base.sensitivity.middleRows(first, value.size()) = sensitivity.cast<float>();
      });
  return bases;
}

/// [rad/s] at which what is left of the speed rings.
double ringing_of(const NullFit& fitted) {
  std::vector<std::vector<double>> all;
  double common = 0;  // [s] between the readings of the first record; others are left out
  for_each_fast_speed(fitted, [&](const Record&, const Observation&, std::vector<double> left, double interval) {
    if (common == 0) common = interval;
    if (std::abs(interval - common) <= 0.01 * common) all.push_back(std::move(left));
  });
  return ringing_frequency(all, common);
}

}  // namespace

FittedMachine motor_of(const Model& model) {
  const std::vector<double> values = model.values();
  return {.R_a = values[base::R_a],
          .K_b = values[base::K_b],
          .K_m = values[base::K_m],
          .B = values[base::B],
          .J = values[base::J],
          .current_driven = model.input == Signal::i_a,
          .seen = {}};
}

Ranges ranges_of(std::span<const Record> records, const Model& model) {
  struct Extremes final : Reader<double> {
    Ranges seen;
    double heat = 0, resistance = 0;
    std::span<const double> t;
    void read(std::size_t k, const SimulatedReadings<double>& y) override {
      seen.voltage = std::max(seen.voltage, std::abs(y.e_a));
      seen.current = std::max(seen.current, std::abs(y.i_a));
      seen.speed = std::max(seen.speed, std::abs(y.omega));
      if (k > 0) heat += resistance * y.i_a * y.i_a * (t[k] - t[k - 1]);
    }
  };
  const std::vector<double> values = model.values();
  Ranges seen;
  seen.inertia = values[base::J];
  const DriverModel& driver = model.structure().driver;
  seen.rise = driver.rise;
  seen.fall = driver.fall;
  for (const Record& record : records) {
    const Excitation& x = record.excitation;
    Extremes extremes;
    extremes.resistance = values[base::R_a];
    extremes.t = x.t;
    simulate<double>(record.structure(model), values, x, extremes);
    for (const double u : x.u_ref) seen.reference = std::max(seen.reference, std::abs(u));
    for (const double e : x.e_a) seen.voltage = std::max(seen.voltage, std::abs(e));
    seen.voltage = std::max(seen.voltage, extremes.seen.voltage);
    seen.current = std::max(seen.current, extremes.seen.current);
    seen.speed = std::max(seen.speed, extremes.seen.speed);
    seen.heat = std::max(seen.heat, extremes.heat);
    seen.duration = std::max(seen.duration, x.t.back() - x.t.front());
    const double sample = mean_interval(x.t);
    seen.sample = seen.sample > 0 ? std::min(seen.sample, sample) : sample;
    seen.logging = logged_lag(seen.sample, false);
    seen.logged_lag = logged_lag(seen.sample, record.lags_in_itself);
  }
  seen.supply = supply_of(records, model);
  seen.torque = values[base::K_m] * seen.current;
  seen.response = motor_of(model).time_constant();
  for (std::size_t effect = 0; effect < effect_count; ++effect) {
    if (!model.includes(effect)) continue;
    seen.twist += twist_under(effect, values_of(model.parameters_of(effect)), seen.torque);
  }
  return seen;
}

NullFit null_fit(std::span<const Record> records, const Model& model) {
  const FreeParameters free(model);
  const auto p = static_cast<Eigen::Index>(free.size());
  NullFit fit{
      records, model, std::vector<RotorPhase>(records.size()), {}, {}, OwnSums(p), ranges_of(records, model), {}, 0, p};
  fit.bases.resize(records.size());
  const std::vector<double> values = model.values();
  const std::vector<std::vector<std::size_t>> moved = moved_by(free);
  const auto simulate_one = [&](std::size_t i) {
    const ModelStructure structure = records[i].structure(model);
    fit.phases[i] = best_phase(records[i], structure, values);
    for (BaseResiduals& base : bases_of(records[i], structure, values, moved, fit.phases[i]))
      fit.bases[i].push_back(with_autoregression(std::move(base)));
  };
  parallel_for(records, simulate_one);
  ResidualSpectra spectra;
  const auto add_up = [&] {
    for (std::size_t i = 0; i < records.size(); ++i) {
      for (const BaseResiduals& base : fit.bases[i]) {
        add_to(fit.plain.try_emplace(base.plain.signal, p).first->second, fit.white, base);
        add_squares(fit.left, records[i], base.plain);
      }
    }
  };
  const auto look_for_memory = [&] {
    for (std::size_t i = 0; i < records.size(); ++i) {
      for (const BaseResiduals& base : fit.bases[i]) add_spectrum(spectra, records[i], base.plain);
    }
    fit.memory = longest(memory_of(spectra));
  };
  at_once(add_up, look_for_memory);
  fit.seen.ringing = ringing_of(fit);
  return fit;
}

}  // namespace emtb
