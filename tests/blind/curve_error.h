#pragma once

#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "analysis/discover/law.h"

namespace emtb::blind {

/// RMS of the found curve less the hidden one over the hidden span. @param aside a straight line through zero is B's
inline double curve_error(const Law& law, const std::string& over, const std::function<double(double)>& truth,
                          bool aside) {
  if (law.text.of.front() != over || law.text.place != TermPlace::torque) return 1;
  double xy = 0, xx = 0, low = 0, high = 0;
  std::vector<double> off;
  for (std::size_t k = 0; k < law.at.size(); ++k) {
    const double v = truth(law.at[k]);
    off.push_back(law.value[k] - v);
    xy += law.at[k] * off.back();
    xx += law.at[k] * law.at[k];
    low = std::min(low, v);
    high = std::max(high, v);
  }
  double squares = 0;
  for (std::size_t k = 0; k < off.size(); ++k) squares += std::pow(off[k] - (aside ? xy / xx * law.at[k] : 0), 2);
  return std::sqrt(squares / static_cast<double>(off.size())) / (high - low);
}

/// What a law says along a run, where it may remember.
inline std::vector<double> law_along(const AddedTerm& law, const MissingTorque& run) {
  std::vector<double> p, by(law.parameters.size()), values;
  for (const Parameter& one : law.parameters) p.push_back(one.value);
  const std::vector<double> memory = law.rate ? memory_along(law, p, run) : std::vector<double>(run.t.size(), 0.0);
  for (std::size_t k = 0; k < run.t.size(); ++k) {
    TermInput by_input;
    const TermInput at{run.omega[k], run.i_a[k], run.theta[k], run.u_ref[k], run.t[k], memory[k]};
    values.push_back(law.term->evaluate(at, p, by_input, by));
  }
  return values;
}

/// The same where what is hidden depends on what was before: RMS over the runs, lines in speed, acceleration and
/// current aside, which are B's, J's and K_m's, over the hidden span. @param truth over a run, as formulas have it
inline double error_along(const Law& law, const WhatIsLeft& left,
                          const std::function<std::vector<double>(const MissingTorque&)>& truth) {
  if (law.text.place != TermPlace::torque) return 1;
  std::vector<double> off, hidden;
  std::vector<Eigen::RowVector3d> lines;
  for (const MissingTorque& run : left.runs) {
    const std::vector<double> found = law_along(law.model.terms.back(), run), true_ones = truth(run);
    for (std::size_t k = 0; k < run.t.size(); ++k) {
      off.push_back(found[k] - true_ones[k]);
      hidden.push_back(true_ones[k]);
      lines.emplace_back(run.omega[k], run.acceleration[k], run.i_a[k]);
    }
  }
  const auto n = static_cast<Eigen::Index>(off.size());
  Eigen::MatrixXd x(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) x.row(i) = lines[static_cast<std::size_t>(i)];
  const Eigen::Map<const Eigen::VectorXd> y(off.data(), n);
  const double rms = (y - x * x.colPivHouseholderQr().solve(y)).norm() / std::sqrt(static_cast<double>(n));
  const auto [low, high] = std::ranges::minmax(hidden);
  return rms / (high - low);
}

}  // namespace emtb::blind
