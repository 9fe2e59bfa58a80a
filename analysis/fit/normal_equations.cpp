#include "analysis/fit/normal_equations.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "analysis/fit/summed_pass.h"
#include "analysis/numerics/linear_algebra.h"
#include "analysis/numerics/parallel.h"

namespace emtb {
namespace {

bool wanted(Signal signal, const CalibrationOptions& options) {
  return options.outputs.empty() || std::ranges::find(options.outputs, signal) != options.outputs.end();
}

void add_blocks(const Record& record, const Residuals& r, double length, std::map<long, Eigen::VectorXd>& blocks) {
  for_each_piece(record, r, length, [&](long piece, Eigen::Index begin, Eigen::Index rows) {
    const Eigen::VectorXd g = transposed_product(r.sensitivity.middleRows(begin, rows), r.value.segment(begin, rows));
    auto& sum = blocks[piece];
    if (sum.size() == 0) sum.setZero(g.size());
    sum += g;
  });
}

std::vector<char> wanted_of(const Record& record, const CalibrationOptions& options) {
  std::vector<char> out;
  for (const Observation& o : record.observations) out.push_back(wanted(o.signal, options) ? 1 : 0);
  return out;
}

/// @param with_sensitivities of all parameters; else the squares alone
void add(NormalEquations& n, const PassSums& sums, bool with_sensitivities) {
  using Rows = Eigen::Matrix<double, PassSums::most, PassSums::most, Eigen::RowMajor>;
  n.rtr += sums.rtr;
  if (!with_sensitivities) return;
  n.sts += Eigen::Map<const Rows>(sums.sts.data()).topLeftCorner(n.sts.rows(), n.sts.cols());
  n.str += Eigen::Map<const Eigen::VectorXd>(sums.str.data(), n.str.size());
}

/// The gradients of blocks of one piece, of two, four ...
BlockGradients block_gradients_of(const std::map<long, Eigen::VectorXd>& pieces) {
  BlockGradients gradients;
  for (std::size_t doubled = 0; doubled < gradients.size(); ++doubled) {
    std::vector<Eigen::VectorXd>& blocks = gradients[doubled];
    long last = -1;
    for (const auto& [piece, gradient] : pieces) {
      const long block = piece >> doubled;
      if (block == last) {
        blocks.back() += gradient;
      } else {
        blocks.push_back(gradient);
      }
      last = block;
    }
  }
  return gradients;
}

}  // namespace

FitProblem::FitProblem(std::span<const Record> records, const Model& model, const CalibrationOptions& options)
    : records_(records),
      model_(model),
      options_(options),
      free_(model),
      moved_(moved_by(free_)),
      shortest_piece_(shortest_piece(records)) {
  for (const std::size_t place : free_.places()) {
    const Parameter& p = model.at(place);
    if (p.prior) priors_.push_back({static_cast<Eigen::Index>(*free_.mover(place)), *p.prior});
  }
}

bool FitProblem::finds_better_phases(std::span<const double> x, double share) const {
  if (!options_.phases.empty()) return false;
  const RotorPhases followed = phases_;
  const double before = least_;
  search_phases();
  if (normal_equations(x, false, false).rtr < (1 - share) * before) return true;
  phases_ = followed;
  least_ = before;
  return false;
}

NormalEquations FitProblem::of_record(std::size_t i, std::span<const double> values, bool with_sensitivities,
                                      bool to_judge, RotorPhase& phase) const {
  const Record& record = records_[i];
  const bool in_steps = to_judge && !options_.quick_errors;
  const auto p = static_cast<Eigen::Index>(free_.size());
  const auto moved = with_sensitivities ? std::span(moved_) : std::span<const std::vector<std::size_t>>{};
  NormalEquations n;
  n.sts.setZero(p, p);
  n.str.setZero(p);
  n.str_of_step.setZero(p);
  const ModelStructure structure = record.structure(model_);
  phase = best_phase(record, structure, values, phases_.empty() ? nullptr : &phases_[i]);
  n.rtr += phase.unlikely;
  if (!to_judge && phase.at.empty() && moved.size() <= PassSums::most) {
    add(n, summed_pass(record, structure, values, moved, wanted_of(record, options_)), with_sensitivities);
    return n;
  }
  std::vector<Residuals> finer;
  if (in_steps) finer = residuals_at_phase(record, structure, values, {}, phase, StepLength::half).residuals;
  const auto [all, prior] = residuals_at_phase(record, structure, values, moved, phase);
  if (prior.sts.size() > 0) {
    n.sts += prior.sts;
    n.str += prior.str;
  }
  std::map<long, Eigen::VectorXd> blocks;
  for (std::size_t s = 0; s < all.size(); ++s) {
    const Residuals& r = all[s];
    if (!wanted(r.signal, options_)) continue;
    n.rtr += r.value.squaredNorm();
    if (!r.informed()) continue;
    n.sts += gram(r.sensitivity);
    n.str += transposed_product(r.sensitivity, r.value);
    if (!to_judge) continue;
    add_blocks(record, r, shortest_piece_, blocks);
    if (!in_steps) continue;
    constexpr double second_order = 4.0 / 3;  // half steps show three quarters of the error
    n.str_of_step += second_order * transposed_product(r.sensitivity, finer[s].value - r.value);
  }
  n.block_gradients = block_gradients_of(blocks);
  return n;
}

NormalEquations FitProblem::normal_equations(std::span<const double> x, bool with_sensitivities, bool to_judge) const {
  const auto p = static_cast<Eigen::Index>(free_.size());
  const std::vector<double> values = free_.spread(x);
  std::vector<NormalEquations> each(records_.size());
  RotorPhases phases(records_.size());
  parallel_for(records_,
               [&](std::size_t i) { each[i] = of_record(i, values, with_sensitivities, to_judge, phases[i]); });
  NormalEquations sum{Eigen::MatrixXd::Zero(p, p), Eigen::VectorXd::Zero(p), 0, {}, Eigen::VectorXd::Zero(p)};
  for (NormalEquations& n : each) {
    sum.sts += n.sts;
    sum.str += n.str;
    sum.str_of_step += n.str_of_step;
    sum.rtr += n.rtr;
    for (std::size_t b = 0; b < n.block_gradients.size(); ++b) {
      std::ranges::move(n.block_gradients[b], std::back_inserter(sum.block_gradients[b]));
    }
  }
  for (const auto& [column, prior] : priors_) {
    const double r = (prior.value - x[static_cast<std::size_t>(column)]) / prior.std;
    sum.sts(column, column) += 1 / (prior.std * prior.std);
    sum.str[column] += r / prior.std;
    sum.rtr += r * r;
  }
  if (sum.rtr <= least_) {  // a step that was too long may have left the valley: it is not followed
    least_ = sum.rtr;
    phases_ = std::move(phases);
  }
  return sum;
}

}  // namespace emtb
