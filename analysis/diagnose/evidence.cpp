#include "analysis/diagnose/evidence.h"

#include <algorithm>
#include <numbers>
#include <string>

#include "hal/error.h"
#include "model/catalogue.h"

namespace emtb {

using Eigen::MatrixXd;
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
    const AddedTerm& formula = fitted.model.offered[part.effect - effect_count];
    x.structure.terms.push_back({formula.place, formula.term, formula.parameters.size()});
  }
  return x;
}

/// The root of a negative speed, say: one such formula would leave nothing of the whole batch.
void refuse_what_is_not_finite(std::span<const Residuals> seen, const Record& record, const Batch& batch) {
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

}  // namespace

std::vector<std::vector<Evidence>> evidence_of(const NullFit& fitted, std::size_t index, const Batch& batch) {
  const Record& record = fitted.records[index];
  const Extended x = extend(fitted, record, batch);
  std::vector<Residuals> seen;
  if (batch.front().whole) {
    seen = residuals_at_phase(record, x.structure, x.values, {}, fitted.phases[index]).residuals;
    for (std::size_t s = 0; s < seen.size(); ++s) {
      const VectorXd change = fitted.bases[index][s].plain.value - seen[s].value;
      if (change.squaredNorm() > 0) seen[s].sensitivity = change;
    }
  } else {
    seen = residuals_at_phase(record, x.structure, x.values, x.columns, fitted.phases[index]).residuals;
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
    const WhitenedResiduals& base = fitted.bases[index][s];
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

}  // namespace emtb
