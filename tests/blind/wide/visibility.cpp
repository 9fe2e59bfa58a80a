#include "tests/blind/wide/visibility.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace emtb::blind::wide {
namespace {

/// Solves a symmetric system with a touch of ridge: what cannot be told apart shares.
std::vector<double> solve(std::vector<std::vector<double>> a, std::vector<double> b) {
  const std::size_t n = b.size();
  for (std::size_t i = 0; i < n; ++i) a[i][i] = a[i][i] * (1 + 1e-9) + 1e-30;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = i + 1; k < n; ++k) {
      const double factor = a[k][i] / a[i][i];
      for (std::size_t j = i; j < n; ++j) a[k][j] -= factor * a[i][j];
      b[k] -= factor * b[i];
    }
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t j = i + 1; j < n; ++j) b[i] -= a[i][j] * b[j];
    b[i] /= a[i][i];
  }
  return b;
}

double rms(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v * v;
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(values.size(), 1)));
}

double spread(const std::vector<double>& values) {
  double mean = 0;
  for (const double v : values) mean += v / static_cast<double>(values.size());
  std::vector<double> moved = values;
  for (double& v : moved) v -= mean;
  return rms(moved);
}

/// The plant with one of its constants a little larger.
std::vector<std::function<void(simulated::PlantParameters&)>> directions(const simulated::PlantParameters& p) {
  constexpr double more = 1.02;
  std::vector<std::function<void(simulated::PlantParameters&)>> list{
      [](auto& q) { q.motor.R_a *= more; }, [](auto& q) { q.motor.K_b *= more, q.motor.K_m *= more; },
      [](auto& q) { q.motor.B *= more; }, [](auto& q) { q.motor.J *= more; }};
  if (p.friction.T_c > 0) list.emplace_back([](auto& q) { q.friction.T_c *= more; });
  if (p.motor.windage > 0) list.emplace_back([](auto& q) { q.motor.windage *= more; });
  if (p.shaft.J_2 > 0) list.emplace_back([](auto& q) { q.shaft.stiffness *= more; });
  return list;
}

}  // namespace

Visibility::Visibility(const WideBench& bench, std::uint64_t seed) : base_(bench), seed_(seed) {
  const double error = base_.model_error;
  for (const auto* list : {&base_.train, &base_.held_out}) {
    for (const Experiment& e : *list) written_.push_back(record(base_, e, seed_).written);
  }
  base_.model_error = 0;
  plain_ = ideal(base_);
  for (const auto& change : directions(base_.plant)) {
    WideBench other = base_;
    change(other.plant);
    Readings moved = ideal(other);
    for (auto& [signal, values] : moved) {
      for (std::size_t k = 0; k < values.size(); ++k) values[k] -= plain_.at(signal)[k];
    }
    sensitivities_.push_back(std::move(moved));
  }
  for (const auto& [signal, values] : plain_) {
    const Instrument* i = base_.find(signal);
    sigma_[signal] = i != nullptr ? i->sigma() : base_.speed_sigma();
    moves_[signal] = spread(values);
  }
  if (error > 0) {
    WideBench shaken = base_;
    shaken.model_error = error;
    model_error_ = unexplained(ideal(shaken), plain_);
  }
}

Visibility::Readings Visibility::ideal(const WideBench& bench) const {
  Readings all;
  std::size_t run = 0;
  for (const auto* list : {&base_.train, &base_.held_out}) {
    for (const Experiment& e : *list) {
      const Recording recording = record(bench, e, seed_, written_[run]);
      for (const auto& [signal, values] : recording.ideal) {
        // Where the file has the terminal voltage in place of the reference, it is what drives the model.
        if (signal == Signal::e_a && !bench.logs_reference) continue;
        auto& list_of = all[signal];
        list_of.insert(list_of.end(), values.begin(), values.end());
      }
      ++run;
    }
  }
  return all;
}

std::map<Signal, double> Visibility::unexplained(const Readings& with, const Readings& without) const {
  const std::size_t n = sensitivities_.size();
  std::vector<std::vector<double>> normal(n, std::vector<double>(n));
  std::vector<double> right(n);
  Readings change = with;
  for (auto& [signal, values] : change) {
    const double weight = 1 / std::pow(std::max(sigma_.at(signal), 1e-4 * moves_.at(signal)), 2);
    for (std::size_t k = 0; k < values.size(); ++k) {
      values[k] -= without.at(signal)[k];
      for (std::size_t i = 0; i < n; ++i) {
        const double s = sensitivities_[i].at(signal)[k];
        right[i] += weight * s * values[k];
        for (std::size_t j = 0; j <= i; ++j) normal[i][j] += weight * s * sensitivities_[j].at(signal)[k];
      }
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < i; ++j) normal[j][i] = normal[i][j];
  }
  const std::vector<double> amounts = solve(normal, right);
  std::map<Signal, double> left;
  for (auto& [signal, values] : change) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      for (std::size_t i = 0; i < n; ++i) values[k] -= amounts[i] * sensitivities_[i].at(signal)[k];
    }
    left[signal] = rms(values);
  }
  return left;
}

double Visibility::of(const WideBench& hidden, const WideBench& without) const {
  WideBench with = hidden, other = without;
  with.model_error = other.model_error = 0;
  double largest = 0;
  for (const auto& [signal, left] : unexplained(ideal(with), &without == &base_ ? plain_ : ideal(other))) {
    const auto error = model_error_.find(signal);
    const double floor = std::hypot(5 * sigma_.at(signal), error == model_error_.end() ? 0 : 2 * error->second);
    largest = std::max(largest, left / std::max({floor, 0.03 * moves_.at(signal), 1e-30}));
  }
  return largest;
}

}  // namespace emtb::blind::wide
