#include "analysis/diagnose/score.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>

#include "analysis/fit/residuals.h"
#include "analysis/fit/turn.h"
#include "analysis/numerics/linear_algebra.h"
#include "analysis/numerics/orders.h"
#include "analysis/numerics/parallel.h"
#include "analysis/numerics/ringing.h"
#include "hal/error.h"
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

/// What the fitted parameters (s) say of the residuals (r), summed over records.
struct OwnSums {
  MatrixXd ss;
  VectorXd sr;
  double readings = 0;

  explicit OwnSums(Eigen::Index p = 0) : ss(MatrixXd::Zero(p, p)), sr(VectorXd::Zero(p)) {}

  void add(const MatrixXd& s, const VectorXd& r) {
    readings += static_cast<double>(r.size());
    if (s.size() == 0) return;
    ss += gram(s);
    sr += transposed_product(s, r);
  }
};

/// What a candidate (c) has to do with them.
struct CrossSums {
  MatrixXd sc, cc;
  VectorXd cr;

  CrossSums(Eigen::Index p = 0, Eigen::Index q = 0)
      : sc(MatrixXd::Zero(p, q)), cc(MatrixXd::Zero(q, q)), cr(VectorXd::Zero(q)) {}

  void add(const MatrixXd& s, const MatrixXd& c, const VectorXd& r) {
    cc += gram(c);
    cr += transposed_product(c, r);
    if (s.size() > 0) sc += transposed_product(s, c);
  }
  CrossSums& operator+=(const CrossSums& b) {
    sc += b.sc;
    cc += b.cc;
    cr += b.cr;
    return *this;
  }
};

/// What the fitted parameters would do to imitate the candidate: (SᵀS)⁻¹ SᵀC, scaled against their different sizes.
MatrixXd imitation(const OwnSums& own, const CrossSums& cross) {
  return own.ss.rows() == 0 ? cross.sc : solve_normal(own.ss, cross.sc);
}

struct Projected {
  MatrixXd information;  ///< C'ᵀC'
  VectorXd gradient;     ///< C'ᵀr
};

Projected project(const OwnSums& own, const CrossSums& cross, const MatrixXd& imitation) {
  const MatrixXd lost = transposed_product(cross.sc, imitation);
  return {cross.cc - lost - lost.transpose() + transposed_product(imitation, product(own.ss, imitation)),
          cross.cr - transposed_product(imitation, own.sr)};
}

/// P(chi-squared with q degrees of freedom > x), by recurrence over q.
double chi_squared_tail(double x, Eigen::Index q) {
  if (x <= 0) return 1;
  const bool odd = q % 2 == 1;
  double tail = odd ? std::erfc(std::sqrt(x / 2)) : std::exp(-x / 2);
  double term = odd ? std::sqrt(2 * x / std::numbers::pi) * std::exp(-x / 2) : x / 2 * std::exp(-x / 2);
  for (Eigen::Index k = odd ? 3 : 4; k <= q; k += 2) {
    tail += term;
    term *= x / static_cast<double>(k);
  }
  return tail;
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

/// The fitted model's side of the test, shared by all candidates.
struct Fitted {
  std::span<const PreparedRun> records;
  const Model& model;
  std::vector<Turn> turns;               ///< of each record
  std::vector<std::vector<Base>> bases;  ///< of each record, one a signal
  std::map<Signal, OwnSums> plain;
  OwnSums white;
  Ranges seen;
  Eigen::Index parameters = 0;

  OwnSums all() const {
    OwnSums sum(parameters);
    for (const auto& [signal, own] : plain) {
      sum.ss += own.ss;
      sum.sr += own.sr;
      sum.readings += own.readings;
    }
    return sum;
  }
};

/// A candidate at certain values, and how it is looked at: as columns of sensitivities to what is not a shape, as two
/// waves a quarter of a period apart, or, if it fades, as the whole change that it makes.
struct Hypothesis {
  std::size_t effect = 0;
  const EffectInfo* info = nullptr;
  StartValues at{};
  bool whole = false;  ///< the change that it makes as it stands; it fades, or is sudden, or acts on edges

  const EffectInfo& about() const { return *info; }

  /// The parameters that have a null to be scored at.
  std::vector<std::size_t> amplitudes() const {
    std::vector<std::size_t> all;
    for (std::size_t i = 0; i < about().parameter_count; ++i) {
      if (!about().parameter_list[i].shape) all.push_back(i);
    }
    return all;
  }
  std::size_t columns() const { return whole ? 1 : about().periodic ? 2 : amplitudes().size(); }
};

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

/// What the records say of one hypothesis; of each record by itself where its phase is free.
struct Evidence {
  std::map<Signal, CrossSums> plain;
  CrossSums white;

  CrossSums all() const {
    CrossSums sum = white;
    sum.sc.setZero();
    sum.cc.setZero();
    sum.cr.setZero();
    for (const auto& [signal, cross] : plain) sum += cross;
    return sum;
  }
  Evidence& operator+=(const Evidence& b) {
    for (const auto& [signal, cross] : b.plain) {
      auto& own = plain.try_emplace(signal, cross.sc.rows(), cross.sc.cols()).first->second;
      own += cross;
    }
    white += b.white;
    return *this;
  }
};

/// Hypotheses that share a simulation: the same effects may be in it several times, all of them null.
using Batch = std::vector<Hypothesis>;

std::vector<Batch> batches_of(const std::vector<Hypothesis>& hypotheses) {
  std::vector<Batch> batches;
  std::size_t columns = 0;
  for (const Hypothesis& h : hypotheses) {
    const bool alone = h.whole;
    if (batches.empty() || alone || columns + h.columns() > 2 * derivatives_per_pass) {
      batches.emplace_back();
      columns = 0;
    }
    batches.back().push_back(h);
    columns = alone ? 2 * derivatives_per_pass : columns + h.columns();
  }
  return batches;
}

/// The fitted model's structure with a batch built into it.
struct Extended {
  ModelStructure structure;
  std::vector<double> values;
  std::vector<std::vector<std::size_t>> columns;  ///< the places of the batch's columns, in its order
};

Extended extend(const Fitted& fitted, const PreparedRun& record, const Batch& batch) {
  struct Part {
    std::size_t effect = 0;
    std::vector<double> values;
    std::vector<std::size_t> scored;  ///< parameters that are columns
    std::size_t column = 0;
  };
  std::vector<Part> parts, formulas;
  const std::vector<double> given = fitted.model.values();
  std::size_t place = ModelStructure::base_count;
  for (const IncludedEffect& e : fitted.model.effects) {
    const auto begin = given.begin() + static_cast<std::ptrdiff_t>(place);
    parts.push_back({e.effect, {begin, begin + static_cast<std::ptrdiff_t>(e.parameters.size())}, {}, 0});
    place += e.parameters.size();
  }
  std::size_t column = 0;
  for (const Hypothesis& h : batch) {
    std::vector<double> values(h.at.begin(), h.at.begin() + static_cast<std::ptrdiff_t>(h.about().parameter_count));
    if (h.about().periodic) {
      parts.push_back({h.effect, values, {0}, column});
      values.back() += std::numbers::pi / 2;
      parts.push_back({h.effect, values, {0}, column + 1});
    } else {
      (h.effect < effect_count ? parts : formulas)
          .push_back({h.effect, values, h.whole ? std::vector<std::size_t>{} : h.amplitudes(), column});
    }
    column += h.columns();
  }
  std::ranges::stable_sort(parts, {}, &Part::effect);
  Extended x{record.structure(fitted.model), {given.begin(), given.begin() + ModelStructure::base_count}, {}};
  x.structure.effects.clear();
  x.columns.resize(column);
  const auto append = [&](const Part& part) {
    for (std::size_t i = 0; i < part.scored.size(); ++i) {
      x.columns[part.column + i] = {x.values.size() + part.scored[i]};
    }
    x.values.insert(x.values.end(), part.values.begin(), part.values.end());
  };
  for (const Part& part : parts) {
    append(part);
    x.structure.effects.push_back(part.effect);
  }
  x.values.insert(x.values.end(), given.begin() + static_cast<std::ptrdiff_t>(place), given.end());
  for (const Part& part : formulas) {
    append(part);
    const AddedTerm& formula = fitted.model.offered[part.effect - effect_count];
    x.structure.terms.push_back({formula.place, formula.term, formula.parameters.size()});
  }
  return x;
}

/// The root of a negative speed, say: one such formula would leave nothing of the whole batch.
void refuse_what_is_not_finite(std::span<const Residuals> seen, const PreparedRun& record, const Batch& batch) {
  if (std::ranges::all_of(seen, [](const Residuals& r) { return r.value.allFinite() && r.sensitivity.allFinite(); })) {
    return;
  }
  std::string formulas;
  for (const Hypothesis& h : batch) {
    if (h.effect >= effect_count) formulas += (formulas.empty() ? "" : " or ") + std::string(h.about().id);
  }
  if (formulas.empty()) return;
  throw ModelError(record.name + ": the formula " + formulas +
                   " is not finite everywhere in this run. Write it for both signs of omega, i_a and u_ref");
}

/// [s] of a piece within which an angle that wanders keeps step with what repeats: an order's phase is free in each.
constexpr double piece_length = 2;

/// Where the pieces of an observation end, in readings; the last is its end.
std::vector<Eigen::Index> ends_of_pieces(const PreparedRun& record, const Observation& o, std::size_t pieces) {
  const std::vector<double>& t = record.excitation.t;
  std::vector<Eigen::Index> ends;
  std::size_t end = 0;
  while (ends.size() + 1 < pieces) {
    const double until = t.front() + static_cast<double>(ends.size() + 1) * piece_length;
    while (end < o.size() && t[o.last[end]] < until) ++end;
    ends.push_back(static_cast<Eigen::Index>(end));
  }
  ends.push_back(static_cast<Eigen::Index>(o.size()));
  return ends;
}

/// What one record says of each hypothesis of a batch, by pieces where the angle wanders under one that repeats.
std::vector<std::vector<Evidence>> evidence_of(const Fitted& fitted, std::size_t index, const Batch& batch) {
  const PreparedRun& record = fitted.records[index];
  const Extended x = extend(fitted, record, batch);
  std::vector<Residuals> seen;
  if (batch.front().whole) {
    seen = residuals_at_turn(record, x.structure, x.values, {}, fitted.turns[index]).residuals;
    for (std::size_t s = 0; s < seen.size(); ++s) {
      const VectorXd change = fitted.bases[index][s].plain.value - seen[s].value;
      if (change.squaredNorm() > 0) seen[s].sensitivity = change;
    }
  } else {
    seen = residuals_at_turn(record, x.structure, x.values, x.columns, fitted.turns[index]).residuals;
  }
  const std::vector<double>& t = record.excitation.t;
  const auto pieces_of = [&](const Hypothesis& h) {
    const bool many = h.about().periodic && record.angle_wander > 0;
    return many ? 1 + static_cast<std::size_t>((t.back() - t.front()) / piece_length) : 1;
  };
  std::vector<std::vector<Evidence>> all;
  for (const Hypothesis& h : batch) {
    const auto q = static_cast<Eigen::Index>(h.columns());
    all.emplace_back(pieces_of(h), Evidence{{}, CrossSums(fitted.parameters, q)});
  }
  refuse_what_is_not_finite(seen, record, batch);
  for (std::size_t s = 0; s < seen.size(); ++s) {
    if (!seen[s].informed()) continue;
    const Base& base = fitted.bases[index][s];
    const Observation& o = record.observations[s];
    const MatrixXd white = whiten(seen[s].sensitivity, base.rho, base.innovation);
    Eigen::Index column = 0;
    for (std::size_t h = 0; h < batch.size(); ++h) {
      const auto q = static_cast<Eigen::Index>(batch[h].columns());
      const MatrixXd plain_columns = seen[s].sensitivity.middleCols(column, q),
                     white_columns = white.middleCols(column, q);
      const auto sums_of = [&](Evidence& evidence) -> CrossSums& {
        return evidence.plain.try_emplace(base.plain.signal, fitted.parameters, q).first->second;
      };
      if (all[h].size() == 1) {
        sums_of(all[h].front()).add(base.plain.sensitivity, plain_columns, base.plain.value);
        all[h].front().white.add(base.white_sensitivity, white_columns, base.white);
      } else {  // what the parameters of the model could imitate of an order is nothing
        Eigen::Index row = 0;
        for (std::size_t piece = 0; const Eigen::Index end : ends_of_pieces(record, o, all[h].size())) {
          const auto part = [&](const auto& rows) { return rows.middleRows(row, end - row).eval(); };
          sums_of(all[h][piece]).add({}, part(plain_columns), part(base.plain.value));
          all[h][piece].white.add({}, part(white_columns), part(base.white));
          row = end;
          ++piece;
        }
      }
      column += q;
    }
  }
  return all;
}

/// The largest mean square that a step would remove from a signal.
double largest_gain(const Fitted& fitted, const Evidence& evidence, const MatrixXd& imitation, const VectorXd& step) {
  double largest = 0;
  for (const auto& [signal, cross] : evidence.plain) {
    const OwnSums& own = fitted.plain.at(signal);
    const Projected p = project(own, cross, imitation);
    largest = std::max(largest, (2 * step.dot(p.gradient) - step.dot(p.information * step)) / own.readings);
  }
  return largest;
}

/// Found with power 0.8 once this large: significant after Holm, and material in the signal that shows it best.
double detectable(const Fitted& fitted, const Evidence& evidence, const MatrixXd& imitation, double white_information,
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
Score score_of(const Fitted& fitted, const Hypothesis& h, const Evidence& evidence, std::size_t candidates,
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
  result.predicted_gain = largest_gain(fitted, evidence, imitated, step);
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
    const EffectParameter& first = about.parameter_list[0];
    const double absent = about.clips ? 1 / fitted.seen.voltage : 0;
    if (about.sudden || about.edges) {
      size *= std::abs(h.at[0] - (first.known ? fitted.seen.rise : first.null));
    } else {
      size = size < infinity && h.at[0] > 0 ? 1 / std::max(1e-300, absent + size * (1 / h.at[0] - absent)) : 0;
    }
  }
  result.detectable_size = size;
  return result;
}

/// Scores an order of the shaft. Its phase is free in each part, so each explains its own; what they agree on is the
/// amplitude. (What the fitted parameters could imitate of a ripple is nothing.)
Score score_of_order(const Fitted& fitted, const Hypothesis& h, const std::vector<Evidence>& parts,
                     std::size_t candidates, const ScoreOptions& options) {
  double statistic = 0, information = 0, found = 0, gain = 0, readings = 0;
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
  result.visibility = 1;
  constexpr double places = 1e3;  // orders among which chance could have picked
  result.p_value = std::min(1.0, places * chi_squared_tail(statistic, freedom));
  const double z = normal_quantile(options.false_alarms / 2 / places / static_cast<double>(candidates)) + 0.84;
  result.detectable_size =
      std::max(z / std::sqrt(information), std::sqrt(options.material_least * readings / information));
  return result;
}

/// Calls visit(record, o, left, interval) for each speed that was read fast, with what is left of it and the [s]
/// between its readings.
template <class Visit>
void for_each_fast_speed(const Fitted& fitted, const Visit& visit) {
  for (std::size_t i = 0; i < fitted.records.size(); ++i) {
    const PreparedRun& record = fitted.records[i];
    const std::vector<double>& t = record.excitation.t;
    for (std::size_t s = 0; s < record.observations.size(); ++s) {
      const Observation& o = record.observations[s];
      if (o.signal != Signal::omega || o.slow || o.size() < 2) continue;
      const VectorXd& left = fitted.bases[i][s].plain.value;
      visit(record, o, std::vector<double>(left.begin(), left.end()),
            (t[o.last.back()] - t[o.last.front()]) / static_cast<double>(o.size() - 1));
    }
  }
}

/// The orders that stand out of what is left of the speed.
std::vector<Order> orders_left(const Fitted& fitted) {
  std::vector<TurningStretch> stretches;
  for_each_fast_speed(fitted,
                      [&](const PreparedRun& record, const Observation& o, std::vector<double> left, double interval) {
                        const Excitation& x = record.excitation;
                        if (x.angle.empty()) return;
                        TurningStretch stretch{{}, without_slow_changes(std::move(left), interval)};
                        for (const std::uint32_t k : o.last) stretch.angle.push_back(x.angle[k]);
                        stretches.push_back(std::move(stretch));
                      });
  return strong_orders(stretches, 3);
}

/// [rad/s] at which what is left of the speed rings.
double ringing_of(const Fitted& fitted) {
  std::vector<std::vector<double>> all;
  double common = 0;  // [s] between the readings of the first record; others are left out
  for_each_fast_speed(fitted, [&](const PreparedRun&, const Observation&, std::vector<double> left, double interval) {
    if (common == 0) common = interval;
    if (std::abs(interval - common) <= 0.01 * common) all.push_back(std::move(left));
  });
  return ringing_frequency(all, common);
}

/// Where a search for a formula starts: each shape as given, then half way to each of its bounds.
std::vector<StartValues> starts_of_formula(const EffectInfo& about) {
  StartValues given{};
  for (std::size_t i = 0; i < about.parameter_count; ++i) given[i] = about.parameter_list[i].null;
  std::vector<StartValues> all{given};
  for (std::size_t i = 0; i < about.parameter_count; ++i) {
    const EffectParameter& p = about.parameter_list[i];
    if (!p.shape) continue;
    for (const double bound : {p.min, p.max}) {
      if (bound == p.null) continue;
      StartValues at = given;  // half way by ratio: sizes are guessed within a factor
      at[i] = bound * p.null > 0 ? std::copysign(std::sqrt(bound * p.null), bound) : 0.5 * (bound + p.null);
      all.push_back(at);
    }
  }
  return all;
}

std::vector<Hypothesis> hypotheses_of(const Fitted& fitted, std::span<const std::size_t> candidates,
                                      bool whole_orders) {
  std::vector<Hypothesis> all;
  std::optional<std::vector<Order>> orders;
  for (const std::size_t effect : candidates) {
    const EffectInfo& about = fitted.model.about(effect);
    if (about.sudden && !fitted.model.includes(effect_index(about.needs))) continue;
    if (!about.periodic) {
      bool whole = about.fades();
      for (StartValues at : effect < effect_count ? starts_of(effect, fitted.seen) : starts_of_formula(about)) {
        for (std::size_t i = 0; i < about.parameter_count; ++i) {
          const EffectParameter& parameter = about.parameter_list[i];
          if (!whole && !parameter.shape && !parameter.known) at[i] = parameter.null;
        }
        all.push_back({effect, &about, at, whole});
        whole = whole || about.edges;  // the first of those is its null
      }
      continue;
    }
    const auto order_place = about.order_place();
    if (!order_place) {  // once a turn
      all.push_back({effect, &about, {}, false});
      continue;
    }
    const auto add_order = [&](double per_turn) {
      Hypothesis h{effect, &about, {}, false};
      const EffectParameter& p = about.parameter_list[*order_place];
      if (per_turn < p.min || per_turn > p.max) return;
      h.at[*order_place] = per_turn;
      all.push_back(h);
    };
    if (whole_orders) {
      for (const int n : {2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 14, 15, 16, 18, 20, 22, 24}) add_order(n);
      continue;
    }
    if (!orders) orders = orders_left(fitted);
    for (const Order& order : *orders) {
      constexpr double scale = 0.01;  // of the measured angle, which may be off by as much
      const double whole = std::round(order.per_turn), off = std::abs(order.per_turn - whole);
      add_order(order.per_turn);
      if (whole > 0 && off > 1e-4 * whole && off < scale * whole) add_order(whole);
    }
  }
  // Those that need the short step share their simulations.
  std::ranges::stable_partition(all, [](const Hypothesis& h) { return !h.about().quick; });
  return all;
}

/// How far the fitted model went in the records.
Ranges ranges_of(std::span<const PreparedRun> records, const Model& model) {
  struct Extremes final : Reader<double> {
    Ranges seen;
    double heat = 0, resistance = 0;
    const std::vector<double>* t = nullptr;
    void read(std::size_t k, const SimulatedReadings<double>& y) override {
      seen.voltage = std::max(seen.voltage, std::abs(y.e_a));
      seen.current = std::max(seen.current, std::abs(y.i_a));
      seen.speed = std::max(seen.speed, std::abs(y.omega));
      if (k > 0) heat += resistance * y.i_a * y.i_a * ((*t)[k] - (*t)[k - 1]);
    }
  };
  const std::vector<double> values = model.values();
  Ranges seen;
  seen.inertia = values[4];
  seen.rise = model.structure().driver.rise;
  seen.fall = model.structure().driver.fall;
  for (const PreparedRun& record : records) {
    const Excitation& x = record.excitation;
    Extremes extremes;
    extremes.resistance = values[0];
    extremes.t = &x.t;
    simulate<double>(record.structure(model), values, x, extremes);
    for (const double u : x.u_ref) seen.reference = std::max(seen.reference, std::abs(u));
    for (const double e : x.e_a) seen.voltage = std::max(seen.voltage, std::abs(e));
    seen.voltage = std::max(seen.voltage, extremes.seen.voltage);
    seen.current = std::max(seen.current, extremes.seen.current);
    seen.speed = std::max(seen.speed, extremes.seen.speed);
    seen.heat = std::max(seen.heat, extremes.heat);
    seen.duration = std::max(seen.duration, x.t.back() - x.t.front());
  }
  return seen;
}

}  // namespace

std::vector<Score> score(std::span<const PreparedRun> records, const Model& model,
                         std::span<const std::size_t> candidates, const ScoreOptions& options) {
  const FreeParameters free(model);
  const auto p = static_cast<Eigen::Index>(free.size());
  Fitted fitted{records, model, std::vector<Turn>(records.size()), {}, {}, OwnSums(p), ranges_of(records, model), p};
  fitted.bases.resize(records.size());
  const std::vector<double> values = model.values();
  const std::vector<std::vector<std::size_t>> moved = moved_by(free);
  const auto fit_of = [&](std::size_t i) {
    const ModelStructure structure = records[i].structure(model);
    fitted.turns[i] = best_turn(records[i], structure, values);
    std::vector<Residuals> all = residuals_at_turn(records[i], structure, values, moved, fitted.turns[i]).residuals;
    for (Residuals& r : all) {
      fitted.bases[i].push_back(make_base(std::move(r)));
    }
  };
  parallel_for(records.size(), fit_of, [&](std::size_t i) { return records[i].length(); });
  for (const auto& bases : fitted.bases) {
    for (const Base& base : bases) {
      fitted.plain.try_emplace(base.plain.signal, p).first->second.add(base.plain.sensitivity, base.plain.value);
      fitted.white.add(base.white_sensitivity, base.white);
    }
  }

  fitted.seen.ringing = ringing_of(fitted);
  const std::vector<Batch> batches = batches_of(hypotheses_of(fitted, candidates, options.whole_orders));
  std::vector<std::vector<std::vector<Evidence>>> evidence(batches.size() * records.size());
  parallel_for(
      evidence.size(),
      [&](std::size_t k) { evidence[k] = evidence_of(fitted, k % records.size(), batches[k / records.size()]); },
      [&](std::size_t k) { return records[k % records.size()].length(); });

  // The best of a candidate's hypotheses; the more there are, the less its p-value is worth.
  std::map<std::size_t, std::vector<Score>> of_effect;
  for (std::size_t b = 0; b < batches.size(); ++b) {
    for (std::size_t h = 0; h < batches[b].size(); ++h) {
      const Hypothesis& hypothesis = batches[b][h];
      std::vector<Evidence> parts;  // the records, or pieces of them
      for (std::size_t i = 0; i < records.size(); ++i) {
        std::ranges::move(evidence[b * records.size() + i][h], std::back_inserter(parts));
      }
      if (hypothesis.about().periodic) {
        of_effect[hypothesis.effect].push_back(score_of_order(fitted, hypothesis, parts, candidates.size(), options));
        continue;
      }
      for (std::size_t i = 1; i < parts.size(); ++i) parts[0] += parts[i];
      of_effect[hypothesis.effect].push_back(score_of(fitted, hypothesis, parts[0], candidates.size(), options));
    }
  }
  std::vector<Score> scores;
  for (const std::size_t effect : candidates) {
    const std::vector<Score>& tried = of_effect[effect];
    if (tried.empty()) {  // no order of the shaft stands out
      scores.emplace_back();
      scores.back().effect = effect;
      const std::vector<double> nothing(model.about(effect).parameter_count, 0.0);
      scores.back().starts.push_back({nothing, nothing, {}});
      scores.back().detectable_size = infinity;
      continue;
    }
    Score best = *std::ranges::max_element(tried, {}, &Score::predicted_drop);
    const bool shaped = std::ranges::any_of(model.about(effect).parameters(), &EffectParameter::shape);
    const bool several =
        (model.about(effect).fades() && shaped) || model.about(effect).sudden || model.about(effect).periodic;
    if (several) {
      for (const Score& other : tried) {
        if (other.expected() != best.expected()) best.starts.push_back(other.starts.front());
      }
    }
    if (model.about(effect).edges) {
      best.detectable_size = std::ranges::min_element(tried, {}, &Score::detectable_size)->detectable_size;
    }
    best.p_value = std::min(
        1.0, std::ranges::min_element(tried, {}, &Score::p_value)->p_value * static_cast<double>(tried.size()));
    scores.push_back(std::move(best));
  }
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
  // Whitening can hide an effect whose residuals look like noise of a long memory. What promises this much is tried.
  const auto rest = scores.begin() + static_cast<std::ptrdiff_t>(passed);
  scores.erase(
      std::remove_if(rest, scores.end(), [&](const Score& s) { return s.predicted_gain < options.gain_worth_a_refit; }),
      scores.end());
  // Far below what is material even if the prediction were some times too small: not worth a refit.
  std::erase_if(scores, [&](const Score& s) { return s.predicted_gain < 0.02 * options.material_least; });
  std::ranges::stable_sort(scores, std::greater{}, &Score::predicted_drop);
  return scores;
}

std::optional<RefitStart> with_effect(std::span<const PreparedRun> records, const Model& fitted, double squares,
                                      std::size_t effect, const Score::Start& start, std::span<const Turn> turns) {
  const FreeParameters free(fitted);
  const EffectInfo& about = fitted.about(effect);
  const auto at = [&](double share) {
    Model extended = fitted;
    for (std::size_t i = 0; i < start.others.size(); ++i) {
      Parameter& p = extended.at(free.places()[i]);
      p.value = std::clamp(p.value + std::min(share, 1.0) * start.others[i], p.min, p.max);
    }
    extended.include(effect);
    std::vector<Parameter>& added = extended.parameters_of(effect);
    for (std::size_t i = 0; i < added.size(); ++i) {
      Parameter& p = added[i];
      if (p.fixed) continue;
      const double part = about.parameter_list[i].shape ? std::min(share, 1.0) : share;
      p.value = std::clamp(start.from[i] + part * (start.expected[i] - start.from[i]), p.min, p.max);
    }
    return extended;
  };
  RefitStart best;
  best.turns.assign(turns.begin(), turns.end());
  // The turns are searched for the whole way, and followed from there.
  const auto look_at = [&](double share) {
    RefitStart there{at(share), 0, {}};
    Turned seen = residuals_at_best_turns(records, there.model, there.model.values(), {}, best.turns);
    there.squares = sum_of_squares(seen.residuals);
    there.turns = std::move(seen.turns);
    return there;
  };
  best = look_at(1);
  // The score is linear; what it expects of an effect that another imitates can be far off.
  for (const double share : {0.5, 0.2, 0.05}) {
    if (best.squares < squares) break;
    if (RefitStart nearer = look_at(share); !(nearer.squares >= best.squares)) best = std::move(nearer);
  }
  // It sees only as much of a wave as keeps step with the measured angle, which wanders.
  for (double share = 2; about.periodic && best.squares < squares && share <= 16; share *= 2) {
    RefitStart larger = look_at(share);
    if (!(larger.squares < best.squares)) break;
    best = std::move(larger);
  }
  if (!std::isfinite(best.squares)) return std::nullopt;
  return best;
}

}  // namespace emtb
