#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "emtb/version.h"
#include "export/linear.h"
#include "export/step_text.h"
#include "hal/error.h"

namespace emtb {
namespace {

using json = nlohmann::ordered_json;
using Matrix = std::vector<std::vector<double>>;

/// Standard errors of what is computed of a model, to first order, as if its parameters were independent.
std::vector<double> errors_of(const Model& model, const std::function<std::vector<double>(const Model&)>& computed) {
  std::vector<double> variance(computed(model).size());
  for (std::size_t i = 0; i < model.values().size(); ++i) {
    const double sigma = model.at(i).std_error.value_or(0);
    if (sigma <= 0 || model.tie.contains(model.names()[i])) continue;
    Model up = model, down = model;
    up.at(i).value += sigma;
    down.at(i).value -= sigma;
    const std::vector<double> high = computed(up), low = computed(down);
    for (std::size_t k = 0; k < variance.size(); ++k) variance[k] += std::pow(0.5 * (high[k] - low[k]), 2);
  }
  for (double& v : variance) v = std::sqrt(v);
  return variance;
}

json head(const Model& model, const WorkingPoint& at, const LinearMachine& m) {
  json out{{"model", model.name}, {"made_by", std::string("emtb ") + version}};
  out["working_point"] = {{"omega", at.omega}, {"load", at.load}, {"i_a", m.i_a}, {"e_driver", m.e_a}};
  out["of_changes"] = !not_linear(model).empty();
  out["delay_s"] = m.delay;
  out["left_out"] = json::array();
  if (model.driver && model.input == Signal::u_ref) {
    out["left_out"].push_back("the driver's limits: " + exact(model.driver->rise) + " and " +
                              exact(model.driver->fall) + " V/s, " + exact(model.driver->min) + " to " +
                              exact(model.driver->max) + " V");
  }
  out["covariance"] = nullptr;  // a model file holds standard errors only
  out["parameters"] = json::object();
  const std::vector<std::string> names = model.names();
  for (std::size_t i = 0; i < names.size(); ++i) {
    const Parameter& p = model.at(i);
    out["parameters"][names[i]] = {{"value", model.values()[i]},
                                   {"std_error", p.std_error ? json(*p.std_error) : json(nullptr)},
                                   {"unit", p.unit}};
  }
  return out;
}

void refuse_bent(const Model& model, const WorkingPoint& at) {
  const std::vector<std::string> bent = not_linear(model);
  if (bent.empty() || std::isfinite(at.omega)) return;
  std::string names;
  for (const std::string& name : bent) names += (names.empty() ? "" : ", ") + name;
  throw ModelError("model `" + model.name + "` is not linear: " + names + ". Add --linear --at RAD_S: at which speed");
}

/// Where no speed was given, of a linear model, any will do.
WorkingPoint settled(const WorkingPoint& at) { return {std::isfinite(at.omega) ? at.omega : 0, at.load}; }

std::vector<double> flat(const StateSpace& s) {
  std::vector<double> all;
  for (const Matrix* m : {&s.A, &s.B, &s.C, &s.D}) {
    for (const auto& row : *m) all.insert(all.end(), row.begin(), row.end());
  }
  return all;
}

/// As many as a matrix holds, in its shape.
Matrix shaped(const Matrix& like, const std::vector<double>& values, std::size_t& next) {
  Matrix out = like;
  for (auto& row : out) {
    for (double& v : row) v = values[next++];
  }
  return out;
}

}  // namespace

StateSpace state_space(const LinearMachine& m, Signal input) {
  StateSpace s;
  s.inputs = {input_name(input), "load"};
  s.outputs = {"omega", "i_a"};
  const bool lags = input == Signal::u_ref && m.lag > 0, inductive = input != Signal::i_a && m.L > 0;
  if (lags) s.states.emplace_back("e_driver");
  if (inductive) s.states.emplace_back("i_a");
  s.states.emplace_back("omega");
  const std::size_t n = s.states.size(), w = n - 1, i = lags ? 1 : 0;
  const double gain = input == Signal::u_ref ? m.gain : 1;
  s.A.assign(n, std::vector<double>(n));
  s.B.assign(n, std::vector<double>(2));
  s.C.assign(2, std::vector<double>(n));
  s.D.assign(2, std::vector<double>(2));
  s.C[0][w] = 1;
  s.A[w][w] = -m.B / m.J;
  s.B[w][1] = -1 / m.J;
  if (lags) {
    s.A[0][0] = -1 / m.lag;
    s.B[0][0] = gain / m.lag;
  }
  // The current: a state, the input, or what voltage and speed leave at once.
  if (input == Signal::i_a) {
    s.B[w][0] = m.K_m / m.J;
    s.D[1][0] = 1;
  } else if (inductive) {
    s.A[i][i] = -m.R / m.L;
    s.A[i][w] = -m.K_b / m.L;
    (lags ? s.A[i][0] : s.B[i][0]) = (lags ? 1 : gain) / m.L;
    s.A[w][i] = m.K_m / m.J;
    s.C[1][i] = 1;
  } else {
    s.A[w][w] -= m.K_m * m.K_b / (m.R * m.J);
    (lags ? s.A[w][0] : s.B[w][0]) = (lags ? 1 : gain) * m.K_m / (m.R * m.J);
    s.C[1][w] = -m.K_b / m.R;
    (lags ? s.C[1][0] : s.D[1][0]) = (lags ? 1 : gain) / m.R;
  }
  return s;
}

std::vector<TransferFunction> transfer_functions(const LinearMachine& m, Signal input) {
  const std::string from = input_name(input);
  if (input == Signal::i_a) return {{from, "omega", {m.K_m}, {m.J, m.B}}, {"load", "omega", {-1}, {m.J, m.B}}};
  const double gain = input == Signal::u_ref ? m.gain : 1;
  std::vector<double> slow{m.R * m.J, m.R * m.B + m.K_b * m.K_m};
  if (m.L > 0) slow = {m.L * m.J, m.L * m.B + m.R * m.J, m.R * m.B + m.K_b * m.K_m};
  std::vector<double> all = slow;
  if (input == Signal::u_ref && m.lag > 0) {
    all.assign(slow.size() + 1, 0);
    for (std::size_t k = 0; k < slow.size(); ++k) {
      all[k] += m.lag * slow[k];
      all[k + 1] += slow[k];
    }
  }
  const std::vector<double> circuit = m.L > 0 ? std::vector{-m.L, -m.R} : std::vector{-m.R};
  return {{from, "omega", {gain * m.K_m}, all},
          {from, "i_a", {gain * m.J, gain * m.B}, all},
          {"load", "omega", circuit, slow},
          {"load", "i_a", {m.K_b}, slow}};
}

std::string state_space_json(const Model& model, const WorkingPoint& given) {
  refuse_bent(model, given);
  const WorkingPoint at = settled(given);
  const LinearMachine m = linearise(model, at);
  const StateSpace s = state_space(m, model.input);
  const std::vector<double> errors =
      errors_of(model, [&](const Model& other) { return flat(state_space(linearise(other, at), other.input)); });
  json out = head(model, at, m);
  out["states"] = s.states;
  out["inputs"] = s.inputs;
  out["outputs"] = s.outputs;
  out["A"] = s.A;
  out["B"] = s.B;
  out["C"] = s.C;
  out["D"] = s.D;
  std::size_t next = 0;
  for (const auto& [name, matrix] : {std::pair{"A", &s.A}, {"B", &s.B}, {"C", &s.C}, {"D", &s.D}})
    out["std_error"][name] = shaped(*matrix, errors, next);
  return out.dump(2) + "\n";
}

std::string transfer_functions_json(const Model& model, const WorkingPoint& given) {
  refuse_bent(model, given);
  const WorkingPoint at = settled(given);
  const LinearMachine m = linearise(model, at);
  const auto coefficients = [&](const Model& other) {
    std::vector<double> all;
    for (const TransferFunction& f : transfer_functions(linearise(other, at), other.input)) {
      all.insert(all.end(), f.numerator.begin(), f.numerator.end());
      all.insert(all.end(), f.denominator.begin(), f.denominator.end());
    }
    return all;
  };
  const std::vector<double> errors = errors_of(model, coefficients);
  json out = head(model, at, m);
  auto next = errors.begin();
  for (const TransferFunction& f : transfer_functions(m, model.input)) {
    const auto middle = next + static_cast<std::ptrdiff_t>(f.numerator.size());
    const auto end = middle + static_cast<std::ptrdiff_t>(f.denominator.size());
    out["transfer_functions"].push_back({{"from", f.from},
                                         {"to", f.to},
                                         {"numerator", f.numerator},
                                         {"denominator", f.denominator},
                                         {"numerator_std_error", std::vector(next, middle)},
                                         {"denominator_std_error", std::vector(middle, end)},
                                         {"gain_at_rest", f.numerator.back() / f.denominator.back()}});
    next = end;
  }
  return out.dump(2) + "\n";
}

}  // namespace emtb
