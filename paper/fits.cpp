#include "paper/fits.h"

#include <algorithm>

#include "analysis/fit/calibrate.h"
#include "analysis/fit/residuals.h"
#include "analysis/record/noise_floor.h"
#include "analysis/record/record.h"
#include "analysis/record/weights.h"
#include "hal/error.h"
#include "model/catalogue.h"
#include "model/simulation.h"
#include "paper/bench.h"

namespace emtb::paper {
namespace {

constexpr double fixed_to = 0.1;  // relative error of a combination that counts as determined

std::size_t place_of(const Model& model, const std::string& parameter) {
  const std::vector<std::string> names = model.names();
  const auto found = std::ranges::find(names, parameter);
  if (found == names.end()) throw ModelError(model.name + " has no parameter " + parameter);
  return static_cast<std::size_t>(found - names.begin());
}

std::vector<Record> prepared(const std::vector<Run>& runs, const std::vector<Signal>& seen, const Model& model) {
  std::vector<ObservedRun> all;
  for (Run run : runs) {
    std::erase_if(run.signals, [&](const auto& s) { return std::ranges::find(seen, s.first) == seen.end(); });
    ObservedRun one = observe_run(run, model);
    // The linear model says nothing of the brake: what the gauge reads loads the shaft, and is not compared.
    std::erase_if(one.observations, [](const Observation& o) { return o.signal == Signal::torque; });
    all.push_back(std::move(one));
  }
  const Noise noise = estimate_noise(all, model);
  std::vector<Record> records;
  for (ObservedRun& one : all) records.push_back(weighed(std::move(one), noise, model));
  return records;
}

}  // namespace

double OutputErrorFit::at(const std::string& parameter) const { return model.values()[place_of(model, parameter)]; }

double OutputErrorFit::gain() const { return at("K_m") / (at("K_m") * at("K_b") + at("R_a") * at("B")); }

double OutputErrorFit::time_constant() const {
  return at("R_a") * at("J") / (at("K_m") * at("K_b") + at("R_a") * at("B"));
}

Model linear_model(double R_a, double K_b, double K_m, double B, double J) {
  Model model;
  model.name = "linear";
  model.driver = DriverModel{.gain = printed::voltage / printed::reference,
                             .rise = printed::rise,
                             .fall = printed::fall,
                             .min = 0,
                             .max = printed::voltage};
  const double values[] = {R_a, K_b, K_m, B, J};
  for (std::size_t i = 0; i < base_parameters.size(); ++i) {
    Parameter p;
    p.symbol = base_parameters[i].symbol;
    p.unit = base_parameters[i].unit;
    p.value = p.min = p.max = values[i];
    p.fixed = true;
    model.base.push_back(p);
  }
  return model;
}

Model with_friction(Model model, double T_c) {
  model.include(effect_index("coulomb_friction"));
  Parameter& p = model.at(place_of(model, "coulomb_friction.T_c"));
  p.value = T_c;
  p.max = 1;
  return model;
}

Model freed(Model model, const std::vector<Range>& ranges) {
  for (const auto& [parameter, min, max] : ranges) {
    Parameter& p = model.at(place_of(model, parameter));
    p.fixed = false;
    p.min = min;
    p.max = max;
  }
  return model;
}

Model starting_from(Model model, const std::map<std::string, double>& values) {
  for (const auto& [parameter, value] : values) model.at(place_of(model, parameter)).value = value;
  return model;
}

OutputErrorFit fit(std::string name, const std::vector<Run>& runs, const std::vector<Signal>& seen,
                   const Model& model) {
  const std::vector<Record> records = prepared(runs, seen, model);
  const Calibration c = calibrate(records, model, {.extra_starts = 0});
  OutputErrorFit result{.name = std::move(name), .model = c.model};
  result.error = error_of(mean_squares(residuals(records, c.model, c.model.values(), {})));
  for (const double s : c.identifiability.singular_values) {
    result.singular_values.push_back(s);
    ++result.free;
    if (s > 1 / fixed_to) ++result.determined;
  }
  return result;
}

double error_of_model(const std::vector<Run>& runs, const std::vector<Signal>& seen, const Model& model) {
  return error_of(mean_squares(residuals(prepared(runs, seen, model), model, model.values(), {})));
}

std::vector<double> simulated_speed(const Run& run, const Model& model) {
  Run speed = run;
  std::erase_if(speed.signals,
                [](const auto& s) { return std::ranges::find(speed_only, s.first) == speed_only.end(); });
  const ObservedRun prepared_run = observe_run(speed, model);
  Trajectory<double> y;
  const std::vector<double> values = model.values();
  simulate<double>(prepared_run.structure(model), values, prepared_run.excitation, y);
  std::vector<double> omega;
  const Observation& o = prepared_run.observations.front();
  for (std::size_t i = 0; i < o.size(); ++i) omega.push_back(o.predicted(i, [&](std::size_t k) { return y.omega[k]; }));
  return omega;
}

}  // namespace emtb::paper
