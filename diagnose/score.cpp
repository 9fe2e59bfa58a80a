#include "diagnose/score.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "estimate/parallel.h"
#include "estimate/residuals.h"
#include "model/catalogue.h"

namespace emtb {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// One record's residuals of one signal and the model's sensitivities, plain and whitened.
struct Base {
  Residuals plain;
  double rho = 0;         ///< autocorrelation of the residuals from one reading to the next
  double innovation = 1;  ///< standard deviation of the whitened residuals
  VectorXd white;
  MatrixXd white_sensitivity;
};

/// x[k] - rho x[k-1], in units of `innovation`.
template <class Matrix>
Matrix whiten(const Matrix& x, double rho, double innovation) {
  const Eigen::Index n = x.rows();
  Matrix y = x;
  if (n > 1) y.bottomRows(n - 1) -= rho * x.topRows(n - 1);
  if (n > 0) y.row(0) *= std::sqrt(1 - rho * rho);
  y /= innovation;
  return y;
}

Base make_base(Residuals r) {
  Base base;
  const Eigen::Index n = r.value.size();
  const double squares = r.value.squaredNorm();
  if (n > 2 && squares > 0) {
    base.rho = std::clamp(r.value.head(n - 1).dot(r.value.tail(n - 1)) / squares, -0.9, 0.999);
  }
  base.white = whiten(r.value, base.rho, 1.0);
  base.innovation =
      std::max(1e-9, std::sqrt(base.white.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, n))));
  base.white /= base.innovation;
  if (r.informed()) base.white_sensitivity = whiten(r.sensitivity, base.rho, base.innovation);
  base.plain = std::move(r);
  return base;
}

/// Sums over all records: fitted parameters (s), candidate (c), residuals (r).
struct Sums {
  MatrixXd ss, sc, cc;
  VectorXd sr, cr;

  Sums(Eigen::Index p, Eigen::Index q)
      : ss(MatrixXd::Zero(p, p)),
        sc(MatrixXd::Zero(p, q)),
        cc(MatrixXd::Zero(q, q)),
        sr(VectorXd::Zero(p)),
        cr(VectorXd::Zero(q)) {}

  void add(const MatrixXd& s, const MatrixXd& c, const VectorXd& r) {
    if (s.size() > 0) {
      ss.noalias() += s.transpose() * s;
      sr.noalias() += s.transpose() * r;
    }
    if (c.size() > 0) {
      cc.noalias() += c.transpose() * c;
      cr.noalias() += c.transpose() * r;
    }
    if (s.size() > 0 && c.size() > 0) sc.noalias() += s.transpose() * c;
  }

  /// What the fitted parameters would do to imitate the candidate: (SᵀS)⁻¹ SᵀC, scaled against their different sizes.
  MatrixXd imitation() const {
    if (ss.rows() == 0) return sc;
    const VectorXd inverse = ss.diagonal().cwiseSqrt().cwiseMax(1e-150).cwiseInverse();
    const MatrixXd scaled = inverse.asDiagonal() * ss * inverse.asDiagonal();
    return inverse.asDiagonal() * scaled.completeOrthogonalDecomposition().solve(inverse.asDiagonal() * sc);
  }
};

struct Projected {
  MatrixXd information;  ///< C'ᵀC'
  VectorXd gradient;     ///< C'ᵀr
};

Projected project(const Sums& sums, const MatrixXd& imitation) {
  const MatrixXd lost = sums.sc.transpose() * imitation;
  return {sums.cc - 0.5 * (lost + lost.transpose()), sums.cr - imitation.transpose() * sums.sr};
}

/// The step a = H⁻¹ g, with parameters that would leave their bounds held at null.
VectorXd expected_step(const Projected& p, const EffectInfo& effect, const VectorXd& full) {
  const Eigen::Index q = p.gradient.size();
  VectorXd step = VectorXd::Zero(q);
  std::vector<Eigen::Index> use;
  for (Eigen::Index i = 0; i < q; ++i) {
    if (p.information(i, i) > 1e-9 * full[i] && full[i] > 0) use.push_back(i);
  }
  while (!use.empty()) {
    const VectorXd part =
        MatrixXd(p.information(use, use)).completeOrthogonalDecomposition().solve(VectorXd(p.gradient(use)));
    std::vector<Eigen::Index> stay;
    for (std::size_t k = 0; k < use.size(); ++k) {
      const EffectParameter& parameter = effect.parameter_list[static_cast<std::size_t>(use[k])];
      const double value = parameter.null + part[static_cast<Eigen::Index>(k)];
      if (value >= parameter.min) stay.push_back(use[k]);
    }
    if (stay.size() == use.size()) {
      step(use) = part;
      break;
    }
    use = stay;
  }
  return step;
}

/// P(chi-squared with q degrees of freedom > x), q = 1, 2, 3.
double chi_squared_tail(double x, Eigen::Index q) {
  if (x <= 0) return 1;
  const double normal = std::erfc(std::sqrt(x / 2));
  if (q == 1) return normal;
  if (q == 2) return std::exp(-x / 2);
  return normal + std::sqrt(2 * x / 3.14159265358979323846) * std::exp(-x / 2);
}

/// The x at which a one-sided normal test has this probability of a false alarm.
double normal_quantile(double tail) {
  double low = 0, high = 40;
  for (int i = 0; i < 80; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(middle / std::sqrt(2.0)) > tail ? low : high) = middle;
  }
  return low;
}

Score score_one(std::span<const PreparedRun> records, const Model& fitted, const std::vector<std::vector<Base>>& bases,
                std::size_t parameters, std::size_t effect, std::size_t candidates, const ScoreOptions& options) {
  const EffectInfo& about = effect_catalogue()[effect];
  Model with = fitted;
  with.include(effect);
  const std::vector<double> values = with.values();
  std::vector<std::vector<std::size_t>> moved;
  std::size_t place = ModelStructure::base_count;
  for (const IncludedEffect& e : with.effects) {
    for (std::size_t i = 0; i < e.parameters.size(); ++i, ++place) {
      if (e.effect == effect) moved.push_back({place});
    }
  }
  const auto p = static_cast<Eigen::Index>(parameters);
  const auto q = static_cast<Eigen::Index>(moved.size());
  Sums plain(p, q), white(p, q);
  std::map<Signal, Sums> by_signal;
  std::map<Signal, double> counts;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const std::vector<Residuals> candidate = residuals(records, i, records[i].structure(with), values, moved);
    for (std::size_t s = 0; s < candidate.size(); ++s) {
      const Base& base = bases[i][s];
      const MatrixXd& c = candidate[s].sensitivity;
      plain.add(base.plain.sensitivity, c, base.plain.value);
      white.add(base.white_sensitivity, c.size() > 0 ? whiten(c, base.rho, base.innovation) : c, base.white);
      by_signal.try_emplace(base.plain.signal, p, q).first->second.add(base.plain.sensitivity, c, base.plain.value);
      counts[base.plain.signal] += static_cast<double>(base.plain.value.size());
    }
  }

  Score result;
  result.effect = effect;
  const VectorXd full = plain.cc.diagonal();
  const MatrixXd imitation = plain.imitation();
  const Projected projected = project(plain, imitation);
  const VectorXd step = expected_step(projected, about, full);
  for (Eigen::Index i = 0; i < q; ++i) {
    result.expected.push_back(about.parameter_list[static_cast<std::size_t>(i)].null + step[i]);
  }
  result.predicted_drop = std::max(0.0, 2 * step.dot(projected.gradient) - step.dot(projected.information * step));
  const double seen =
      full.sum() > 0 ? std::sqrt(std::max(0.0, projected.information(0, 0) / std::max(full[0], 1e-300))) : 0;
  result.visibility = std::min(1.0, seen);

  const Projected whitened = project(white, white.imitation());
  const VectorXd white_step = expected_step(whitened, about, white.cc.diagonal());
  const double statistic = 2 * white_step.dot(whitened.gradient) - white_step.dot(whitened.information * white_step);
  result.p_value = chi_squared_tail(statistic, q);
  if (q == 1 && about.opposes_motion) result.p_value /= 2;  // one-sided: the other half scores nothing

  // Found with power 0.8: significant after Holm, and material in the signal that shows it best.
  const double z =
      normal_quantile(options.false_alarms / 2 / static_cast<double>(std::max<std::size_t>(1, candidates))) + 0.84;
  const double information = whitened.information(0, 0);
  double size =
      information > 1e-12 * white.cc(0, 0) ? z / std::sqrt(information) : std::numeric_limits<double>::infinity();
  double per_unit = 0;
  for (const auto& [signal, sums] : by_signal) {
    const VectorXd b = imitation.col(0);
    const double remains = sums.cc(0, 0) - 2 * b.dot(sums.sc.col(0)) + b.dot(sums.ss * b);
    per_unit = std::max(per_unit, remains / counts[signal]);
  }
  size = std::max(
      size, per_unit > 0 ? std::sqrt(options.material_least / per_unit) : std::numeric_limits<double>::infinity());
  result.detectable_size = size;
  return result;
}

}  // namespace

std::vector<Score> score(std::span<const PreparedRun> records, const Model& fitted,
                         std::span<const std::size_t> candidates, const ScoreOptions& options) {
  const FreeParameters free(fitted);
  std::vector<std::vector<Base>> bases(records.size());
  for (Residuals& r : residuals(records, fitted, fitted.values(), moved_by(free))) {
    bases[r.record].push_back(make_base(std::move(r)));
  }
  std::vector<Score> scores(candidates.size());
  parallel_for(candidates.size(), [&](std::size_t i) {
    scores[i] = score_one(records, fitted, bases, free.size(), candidates[i], candidates.size(), options);
  });
  std::ranges::stable_sort(scores, std::greater{}, &Score::predicted_drop);
  return scores;
}

std::vector<Score> promising(std::vector<Score> scores, const ScoreOptions& options) {
  std::ranges::sort(scores, {}, &Score::p_value);
  std::size_t passed = 0;
  while (passed < scores.size() &&
         scores[passed].p_value <= options.false_alarms / static_cast<double>(scores.size() - passed)) {
    ++passed;
  }
  scores.resize(passed);
  std::erase_if(scores, [](const Score& s) { return s.predicted_drop <= 0; });
  std::ranges::stable_sort(scores, std::greater{}, &Score::predicted_drop);
  return scores;
}

Model with_expected(const Model& model, const Score& score) {
  Model extended = model;
  extended.include(score.effect);
  IncludedEffect& added = *std::ranges::find(extended.effects, score.effect, &IncludedEffect::effect);
  for (std::size_t i = 0; i < added.parameters.size(); ++i) {
    Parameter& p = added.parameters[i];
    p.value = std::clamp(score.expected[i], p.min, p.max);
  }
  return extended;
}

}  // namespace emtb
