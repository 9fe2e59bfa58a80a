#include "analysis/diagnose/evidence.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "hal/error.h"
#include "model/catalogue.h"

namespace emtb {

using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

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

namespace {

/// The fitted model's structure with a batch built into it.
struct Extended {
  ModelStructure structure;
  std::vector<double> values;
  std::vector<std::vector<std::size_t>> columns;  ///< the places of the batch's columns, in its order
};

Extended extend(const NullFit& fitted, const Record& record, const Batch& batch) {
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
      values[h.about().place_of(Role::phase).value()] += std::numbers::pi / 2;
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
    x.structure.terms.push_back(fitted.model.offered[part.effect - effect_count].placed());
  }
  return x;
}

/// The root of a negative speed, say: one such formula would leave nothing of the whole batch.
template <class Matrix>
void refuse_what_is_not_finite(const Matrix& readings, const Record& record, const Batch& batch) {
  if (readings.allFinite()) return;
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
std::vector<Eigen::Index> ends_of_pieces(const Record& record, const Observation& o, std::size_t pieces) {
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

/// Sums what a record says of a batch, from readings as they come.
class Gathering {
 public:
  Gathering(const NullFit& fitted, std::size_t index, const Batch& batch)
      : fitted_(fitted),
        record_(fitted.records[index]),
        bases_(fitted.bases[index]),
        batch_(batch),
        last_(record_.observations.size()),
        ends_(record_.observations.size()) {
    const std::vector<double>& t = record_.excitation.t;
    for (const Hypothesis& h : batch) {
      const bool many = h.about().periodic && record_.angle_wander > 0;
      const std::size_t pieces = many ? 1 + static_cast<std::size_t>((t.back() - t.front()) / piece_length) : 1;
      all_.emplace_back(pieces, Evidence{{}, CrossSums(fitted.parameters, static_cast<Eigen::Index>(h.columns()))});
      if (pieces > 1 && ends_.front().empty()) {
        for (std::size_t s = 0; s < ends_.size(); ++s)
          ends_[s] = ends_of_pieces(record_, record_.observations[s], pieces);
      }
    }
  }

  /// @param change of some readings in a row, a column for each of the batch
  void add(std::size_t observation, Eigen::Index first, const MatrixXd& change) {
    refuse_what_is_not_finite(change, record_, batch_);
    const BaseResiduals& base = bases_[observation];
    const Eigen::Index rows = change.rows(), columns = change.cols();
    both_.resize(rows, 2 * columns);
    const RowVectorXd before = std::exchange(last_[observation], change.row(rows - 1));
    white_ = whitened(base, first, change, before);
    if (change.isZero(0) && white_.isZero(0)) return;  // of a signal that nothing in the batch moves, or not yet
    both_.leftCols(columns) = change;
    both_.rightCols(columns) = whitened_back(base, first, white_);
    const MatrixXd products = products_with_known(base, first, white_.row(0));
    Eigen::Index column = 0;
    for (std::size_t h = 0; h < batch_.size(); ++h) {
      const auto q = static_cast<Eigen::Index>(batch_[h].columns());
      const MatrixPart own = change.middleCols(column, q), own_white = white_.middleCols(column, q);
      if (all_[h].size() > 1) {
        add_by_pieces(all_[h], observation, first, own, own_white);
      } else {
        CrossSums& plain = sums_of(all_[h].front(), base.plain.signal, q);
        plain.add(own, products.middleCols(column, q));
        all_[h].front().white.add(own_white, products.middleCols(columns + column, q));
      }
      column += q;
    }
  }

  std::vector<std::vector<Evidence>> all() && { return std::move(all_); }

 private:
  CrossSums& sums_of(Evidence& evidence, Signal signal, Eigen::Index columns) const {
    return evidence.plain.try_emplace(signal, fitted_.parameters, columns).first->second;
  }

  /// What the sensitivities of the fitted parameters, and in the last row what is left, have to do with columns of the
  /// batch: as they are, then all whitened. Only the columns of the batch are whitened, forth and back: of a sum of
  /// products (W s)ᵀ (W c) = sᵀ (Wᵀ W c) the many s stay as they are.
  /// @param white_first the first row of the whitened columns, which the readings before these belong to as well
  MatrixXd products_with_known(const BaseResiduals& base, Eigen::Index first, const RowVectorXd& white_first) {
    const Eigen::Index rows = both_.rows(), columns = white_first.size();
    const Eigen::Index known = base.informed() ? base.sensitivity.cols() : 0;
    known_.resize(rows, known + 1);
    if (known > 0) known_.leftCols(known) = base.sensitivity.middleRows(first, rows).cast<double>();
    known_.col(known) = base.plain.value.segment(first, rows);
    MatrixXd products = transposed_product(known_, both_);
    if (first > 0) {
      VectorXd before(known + 1);
      if (known > 0) before.head(known) = base.sensitivity.row(first - 1).transpose().cast<double>();
      before[known] = base.plain.value[first - 1];
      products.rightCols(columns) -= (base.rho / base.innovation) * before * white_first;
    }
    if (known > 0) return products;
    MatrixXd moved = MatrixXd::Zero(fitted_.parameters + 1, 2 * columns);  // no parameter moves the signal
    moved.row(fitted_.parameters) = products.row(0);
    return moved;
  }

  /// What the parameters of the model could imitate of an order is nothing.
  void add_by_pieces(std::vector<Evidence>& pieces, std::size_t observation, Eigen::Index first, const MatrixPart& own,
                     const MatrixPart& own_white) {
    const BaseResiduals& base = bases_[observation];
    const Eigen::Index until = first + own.rows();
    const VectorXd left_white = base.left_white(first, own.rows());
    const std::vector<Eigen::Index>& ends = ends_[observation];
    auto piece = static_cast<std::size_t>(std::ranges::upper_bound(ends, first) - ends.begin());
    for (Eigen::Index row = first; row < until; ++piece) {
      const Eigen::Index count = std::min(until, ends[piece]) - row, from = row - first;
      Evidence& evidence = pieces[piece];
      sums_of(evidence, base.plain.signal, own.cols())
          .add(MatrixXd{}, own.middleRows(from, count), base.plain.value.segment(row, count));
      evidence.white.add(MatrixXd{}, own_white.middleRows(from, count), left_white.segment(from, count));
      row += count;
    }
  }

  /// As BaseResiduals::whitened(), of readings as they come.
  /// @param before the row before them
  static MatrixXd whitened(const BaseResiduals& base, Eigen::Index first, const MatrixXd& change,
                           const RowVectorXd& before) {
    const Eigen::Index rows = change.rows();
    MatrixXd white = change;
    white.bottomRows(rows - 1) -= base.rho * change.topRows(rows - 1);
    if (first == 0) {
      white.row(0) *= std::sqrt(1 - base.rho * base.rho);
    } else {
      white.row(0) -= base.rho * before;
    }
    white /= base.innovation;
    return white;
  }

  /// By the transpose of what whitens, but for the row before them.
  static MatrixXd whitened_back(const BaseResiduals& base, Eigen::Index first, const MatrixXd& white) {
    const Eigen::Index rows = white.rows();
    MatrixXd back = white;
    if (first == 0) back.row(0) *= std::sqrt(1 - base.rho * base.rho);
    back.topRows(rows - 1) -= base.rho * white.bottomRows(rows - 1);
    back /= base.innovation;
    return back;
  }

  const NullFit& fitted_;
  const Record& record_;
  const std::vector<BaseResiduals>& bases_;
  const Batch& batch_;
  std::vector<std::vector<Evidence>> all_;
  std::vector<RowVectorXd> last_;                ///< of each observation, the row before the next
  std::vector<std::vector<Eigen::Index>> ends_;  ///< of the pieces of each observation, where there are several
  MatrixXd known_, both_, white_;                ///< of the readings under way; kept to be used again
};

}  // namespace

std::vector<std::vector<Evidence>> evidence_of(const NullFit& fitted, std::size_t index, const Batch& batch) {
  const Record& record = fitted.records[index];
  const Extended x = extend(fitted, record, batch);
  Gathering gathering(fitted, index, batch);
  const bool whole = batch.front().whole;
  const VisitReadings gather = [&](std::size_t s, Eigen::Index first, const VectorXd& value, const MatrixXd& columns) {
    refuse_what_is_not_finite(value, record, batch);
    if (whole) {
      gathering.add(s, first, fitted.bases[index][s].plain.value.segment(first, value.size()) - value);
    } else if (columns.size() > 0) {
      gathering.add(s, first, columns);
    }
  };
  const std::vector<std::vector<std::size_t>> moved = whole ? std::vector<std::vector<std::size_t>>{} : x.columns;
  const RotorPhase& phase = fitted.phases[index];
  if (phase.at.empty()) {
    visit_simulated_residuals(record, x.structure, x.values, moved, gather);
  } else {  // what a little more of the phase would do is taken off all readings together
    const std::vector<Residuals> seen = residuals_at_phase(record, x.structure, x.values, moved, phase).residuals;
    for (std::size_t s = 0; s < seen.size(); ++s) gather(s, 0, seen[s].value, seen[s].sensitivity);
  }
  return std::move(gathering).all();
}

}  // namespace emtb
