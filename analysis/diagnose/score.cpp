#include "analysis/diagnose/score.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>

#include "analysis/diagnose/evidence.h"
#include "analysis/diagnose/hypotheses.h"
#include "analysis/numerics/linear_algebra.h"
#include "analysis/numerics/parallel.h"
#include "analysis/numerics/statistics.h"
#include "model/catalogue.h"

namespace emtb {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The step a = H⁻¹ g, with parameters that would leave their bounds held where they are.
/// @param full diagonal of CᵀC, before projection
VectorXd expected_step(const Projected& p, const Hypothesis& h, const VectorXd& full) {
  const std::vector<std::size_t> amplitudes = h.amplitudes();
  const Eigen::Index q = p.gradient.size();
  VectorXd step = VectorXd::Zero(q);
  std::vector<Eigen::Index> use;
  for (Eigen::Index i = 0; i < q; ++i) {
    if (p.information(i, i) > 1e-9 * full[i] && full[i] > 0) use.push_back(i);
  }
  while (!use.empty()) {
    const VectorXd part = least_squares(p.information(use, use), VectorXd(p.gradient(use)));
    std::vector<Eigen::Index> stay;
    for (std::size_t k = 0; k < use.size(); ++k) {
      const std::size_t i = amplitudes[static_cast<std::size_t>(use[k])];
      if (h.at[i] + part[static_cast<Eigen::Index>(k)] >= h.about().parameter_list[i].min) stay.push_back(use[k]);
    }
    if (stay.size() == use.size()) {
      step(use) = part;
      break;
    }
    use = stay;
  }
  return step;
}

/// The squares that a step would remove from each signal.
std::map<Signal, double> drops_of(const NullFit& fitted, const Evidence& evidence, const MatrixXd& imitation,
                                  const VectorXd& step) {
  std::map<Signal, double> drops;
  for (const auto& [signal, cross] : evidence.plain) {
    const Projected p = project(fitted.plain.at(signal), cross, imitation);
    drops[signal] = 2 * step.dot(p.gradient) - step.dot(p.information * step);
  }
  return drops;
}

/// The largest mean square among them.
double largest_gain(const NullFit& fitted, const std::map<Signal, double>& drops) {
  double largest = 0;
  for (const auto& [signal, drop] : drops) largest = std::max(largest, drop / fitted.plain.at(signal).readings);
  return largest;
}

/// What a step would add to the logarithm of the likelihood.
double nats_of(const NullFit& fitted, const std::map<Signal, double>& drops) {
  double sum = 0;
  for (const auto& [signal, drop] : drops) {
    const auto left = fitted.left.find(signal);
    if (left == fitted.left.end()) continue;
    SignalSquares after = left->second;
    after.squares -= drop;
    sum += log_likelihood(after, fitted.memory) - log_likelihood(left->second, fitted.memory);
  }
  return sum;
}

/// Found with power 0.8 once this large: significant after Holm, and material in the signal that shows it best.
double detectable(const NullFit& fitted, const Evidence& evidence, const MatrixXd& imitation, double white_information,
                  std::size_t candidates, const ScoreOptions& options) {
  const double z =
      normal_quantile(options.false_alarms / 2 / static_cast<double>(std::max<std::size_t>(1, candidates))) + 0.84;
  const double significant =
      white_information > 1e-12 * evidence.white.cc(0, 0) ? z / std::sqrt(white_information) : infinity;
  double per_unit = 0;
  for (const auto& [signal, cross] : evidence.plain) {
    const OwnSums& own = fitted.plain.at(signal);
    per_unit = std::max(per_unit, project(own, cross, imitation).information(0, 0) / own.readings);
  }
  return std::max(significant, per_unit > 0 ? std::sqrt(options.material_least / per_unit) : infinity);
}

/// Scores a hypothesis on what all records say of it together.
Score score_of(const NullFit& fitted, const Hypothesis& h, const Evidence& evidence, std::size_t candidates,
               const ScoreOptions& options) {
  const EffectInfo& about = h.about();
  const std::vector<std::size_t> amplitudes = h.amplitudes();
  Score result;
  result.effect = h.effect;
  const std::vector<double> from(h.at.begin(), h.at.begin() + static_cast<std::ptrdiff_t>(about.parameter_count));
  std::vector<double> expected = from;
  const OwnSums own = fitted.all();
  const CrossSums cross = evidence.all();
  const VectorXd full = cross.cc.diagonal();
  const MatrixXd imitated = imitation(own, cross);
  const Projected projected = project(own, cross, imitated);
  // One that is tried whole is there as it stands: its change, once.
  const VectorXd step = h.whole ? VectorXd::Ones(1) : expected_step(projected, h, full);
  if (!h.whole) {
    for (std::size_t i = 0; i < amplitudes.size(); ++i) {
      expected[amplitudes[i]] += step[static_cast<Eigen::Index>(i)];
    }
  }
  const VectorXd others = -product(imitated, step);
  result.starts.push_back({from, expected, {others.begin(), others.end()}});
  result.predicted_drop = std::max(0.0, 2 * step.dot(projected.gradient) - step.dot(projected.information * step));
  const std::map<Signal, double> drops = drops_of(fitted, evidence, imitated, step);
  result.predicted_gain = largest_gain(fitted, drops);
  result.predicted_nats = nats_of(fitted, drops);
  result.visibility = full[0] > 0 ? std::sqrt(std::clamp(projected.information(0, 0) / full[0], 0.0, 1.0)) : 0;

  const Projected whitened = project(fitted.white, evidence.white, imitation(fitted.white, evidence.white));
  VectorXd white_step = VectorXd::Zero(full.size());
  if (!h.whole) {
    white_step = expected_step(whitened, h, evidence.white.cc.diagonal());
  } else if (whitened.information(0, 0) > 0) {
    white_step[0] = std::max(0.0, whitened.gradient[0] / whitened.information(0, 0));
  }
  const double statistic = 2 * white_step.dot(whitened.gradient) - white_step.dot(whitened.information * white_step);
  result.p_value = chi_squared_tail(statistic, full.size());
  if (full.size() == 1 && (about.opposes_motion || h.whole)) result.p_value /= 2;  // the other half scores nothing

  double size = detectable(fitted, evidence, imitated, whitened.information(0, 0), candidates, options);
  if (h.whole) {
    // `size` is a share of this effect; its parameter lies between where it is absent and where it was tried, about
    // evenly, or where it is absent at infinity evenly in the inverse.
    const double reached = about.clips == Signal::i_a ? fitted.seen.current : fitted.seen.voltage;
    const double absent = about.clips ? 1 / reached : 0;
    if (about.at_null == AtNull::small) {  // the first of its starts is its null
      size *= std::abs(h.at[0] - starts_of(h.effect, fitted.seen).front()[0]);
    } else if (about.at_null == AtNull::nothing) {
      size *= std::abs(h.at[0] - about.parameter_list[0].null);
    } else {
      size = size < infinity && h.at[0] > 0 ? 1 / std::max(1e-300, absent + size * (1 / h.at[0] - absent)) : 0;
    }
  }
  result.detectable_size = size;
  return result;
}

/// Scores an order of the shaft. Its phase is free in each part, so each explains its own; what they agree on is the
/// amplitude. (What the fitted parameters could imitate of a ripple is nothing.)
Score score_of_order(const NullFit& fitted, const Hypothesis& h, const std::vector<Evidence>& parts,
                     std::size_t candidates, const ScoreOptions& options) {
  double statistic = 0, information = 0, found = 0, gain = 0, readings = 0;
  std::map<Signal, double> drops;
  Eigen::Index freedom = 0;
  for (const Evidence& evidence : parts) {
    const CrossSums cross = evidence.all();
    const Eigen::Matrix2d plain = cross.cc, white = evidence.white.cc;
    const Eigen::Vector2d plain_gradient = cross.cr, white_gradient = evidence.white.cr;
    if (white.determinant() <= 1e-12 * white(0, 0) * white(1, 1) || plain.determinant() <= 0) continue;
    information += 0.5 * plain.trace();
    found += plain_gradient.dot(plain.inverse() * plain_gradient) - 2;  // which noise alone explains
    statistic += white_gradient.dot(white.inverse() * white_gradient);
    freedom += 2;
    const Eigen::Vector2d size = plain.inverse() * plain_gradient;
    for (const auto& [signal, own] : evidence.plain) drops[signal] += 2 * size.dot(own.cr) - size.dot(own.cc * size);
  }
  for (const auto& [signal, own] : fitted.plain) {
    if (signal == Signal::omega) readings = own.readings;
  }
  found = std::max(found, 0.0);
  gain = readings > 0 ? found / readings : 0;
  Score result;
  result.effect = h.effect;
  const std::vector<double> from(h.at.begin(), h.at.begin() + static_cast<std::ptrdiff_t>(h.about().parameter_count));
  result.starts.push_back({from, from, {}});
  result.detectable_size = infinity;
  if (freedom == 0) return result;
  result.starts.front().expected[0] = std::sqrt(found / information);
  result.predicted_drop = found;
  result.predicted_gain = gain;
  result.predicted_nats = nats_of(fitted, drops);
  result.visibility = 1;
  constexpr double places = 1e3;  // orders among which chance could have picked
  result.p_value = std::min(1.0, places * chi_squared_tail(statistic, freedom));
  const double z = normal_quantile(options.false_alarms / 2 / places / static_cast<double>(candidates)) + 0.84;
  result.detectable_size =
      std::max(z / std::sqrt(information), std::sqrt(options.material_least * readings / information));
  return result;
}

/// Evidence of all batches on all records, each batch on one record by itself: [batch * records + record].
std::vector<std::vector<std::vector<Evidence>>> evidence_of_all(const NullFit& fitted,
                                                                const std::vector<Batch>& batches) {
  const std::span<const Record> records = fitted.records;
  std::vector<std::vector<std::vector<Evidence>>> evidence(batches.size() * records.size());
  parallel_for(
      evidence.size(),
      [&](std::size_t k) { evidence[k] = evidence_of(fitted, k % records.size(), batches[k / records.size()]); },
      [&](std::size_t k) { return records[k % records.size()].length(); });
  return evidence;
}

/// The scores of each candidate's hypotheses.
std::map<std::size_t, std::vector<Score>> scores_of_hypotheses(const NullFit& fitted, const std::vector<Batch>& batches,
                                                               std::size_t candidates, const ScoreOptions& options) {
  const std::size_t records = fitted.records.size();
  const auto evidence = evidence_of_all(fitted, batches);
  std::map<std::size_t, std::vector<Score>> of_effect;
  for (std::size_t b = 0; b < batches.size(); ++b) {
    for (std::size_t h = 0; h < batches[b].size(); ++h) {
      const Hypothesis& hypothesis = batches[b][h];
      std::vector<Evidence> parts;  // the records, or pieces of them
      for (std::size_t i = 0; i < records; ++i) {
        const std::vector<Evidence>& of_record = evidence[b * records + i][h];
        parts.insert(parts.end(), of_record.begin(), of_record.end());
      }
      if (hypothesis.about().periodic) {
        of_effect[hypothesis.effect].push_back(score_of_order(fitted, hypothesis, parts, candidates, options));
        continue;
      }
      for (std::size_t i = 1; i < parts.size(); ++i) parts[0] += parts[i];
      of_effect[hypothesis.effect].push_back(score_of(fitted, hypothesis, parts[0], candidates, options));
    }
  }
  return of_effect;
}

/// The score of an effect for which nothing was tried: no order of the shaft stands out.
Score score_of_nothing(const Model& model, std::size_t effect) {
  Score none;
  none.effect = effect;
  const std::vector<double> nothing(model.about(effect).parameter_count, 0.0);
  none.starts.push_back({nothing, nothing, {}});
  none.detectable_size = infinity;
  return none;
}

/// The best of a candidate's hypotheses; the more there are, the less its p-value is worth.
Score best_of(const EffectInfo& about, const std::vector<Score>& tried) {
  Score best = *std::ranges::max_element(tried, {}, &Score::predicted_nats);
  const bool shaped = std::ranges::any_of(about.parameters(), &EffectParameter::is_shape);
  const bool several = (about.fades() && shaped) || about.at_null == AtNull::nothing || about.periodic;
  if (several) {
    for (const Score& other : tried) {
      if (other.expected() != best.expected()) best.starts.push_back(other.starts.front());
    }
  }
  if (about.at_null == AtNull::small) {
    best.detectable_size = std::ranges::min_element(tried, {}, &Score::detectable_size)->detectable_size;
  }
  best.p_value =
      std::min(1.0, std::ranges::min_element(tried, {}, &Score::p_value)->p_value * static_cast<double>(tried.size()));
  return best;
}

}  // namespace

std::vector<Score> score(std::span<const Record> records, const Model& model, std::span<const std::size_t> candidates,
                         const ScoreOptions& options) {
  const NullFit fitted = null_fit(records, model);
  const std::vector<Batch> batches = batches_of(hypotheses_of(fitted, candidates, options.whole_orders));
  std::map<std::size_t, std::vector<Score>> tried = scores_of_hypotheses(fitted, batches, candidates.size(), options);
  std::vector<Score> scores;
  for (const std::size_t effect : candidates) {
    const std::vector<Score>& of_effect = tried[effect];
    scores.push_back(of_effect.empty() ? score_of_nothing(model, effect) : best_of(model.about(effect), of_effect));
  }
  std::ranges::stable_sort(scores, std::greater{}, &Score::predicted_nats);
  return scores;
}

std::vector<Score> promising(std::vector<Score> scores, const ScoreOptions& options) {
  std::ranges::sort(scores, {}, &Score::p_value);
  std::size_t passed = 0;
  while (passed < scores.size() &&
         scores[passed].p_value <= options.false_alarms / static_cast<double>(scores.size() - passed)) {
    ++passed;
  }
  // Whitening can hide an effect whose residuals look like noise of a long memory. What promises this much is tried.
  const auto rest = scores.begin() + static_cast<std::ptrdiff_t>(passed);
  scores.erase(
      std::remove_if(rest, scores.end(), [&](const Score& s) { return s.predicted_gain < options.gain_worth_a_refit; }),
      scores.end());
  // Far below what is material even if the prediction were some times too small: not worth a refit.
  std::erase_if(scores, [&](const Score& s) { return s.predicted_gain < 0.02 * options.material_least; });
  std::ranges::stable_sort(scores, std::greater{}, &Score::predicted_nats);
  return scores;
}

}  // namespace emtb
