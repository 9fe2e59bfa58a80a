#include "analysis/fit/normal_equations.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "analysis/fit/summed_pass.h"
#include "analysis/numerics/linear_algebra.h"
#include "analysis/numerics/parallel.h"
#include "analysis/record/supply.h"
#include "model/effect.h"

namespace emtb {
namespace {

bool wanted(Signal signal, const CalibrationOptions& options) {
  return options.outputs.empty() || std::ranges::find(options.outputs, signal) != options.outputs.end();
}

std::vector<char> wanted_of(const Record& record, const CalibrationOptions& options) {
  std::vector<char> out;
  for (const Observation& o : record.observations) out.push_back(wanted(o.signal, options) ? 1 : 0);
  return out;
}

/// @param with_sensitivities of all parameters; else the squares alone
/// @param course of a phase whose column comes last: what it does instead is taken out of the others
void add(NormalEquations& n, const PassSums& sums, bool with_sensitivities, PhaseCourse* course) {
  using Rows = Eigen::Matrix<double, PassSums::most, PassSums::most, Eigen::RowMajor>;
  n.rtr += sums.rtr;
  if (!with_sensitivities) return;
  const Eigen::Index p = n.sts.rows();
  const Eigen::Map<const Rows> sts(sums.sts.data());
  const Eigen::Map<const Eigen::VectorXd> str(sums.str.data(), static_cast<Eigen::Index>(sums.str.size()));
  n.sts += sts.topLeftCorner(p, p);
  n.str += str.head(p);
  if (course == nullptr || !(sts(p, p) > 0)) return;
  const Eigen::VectorXd instead = sts.col(p).head(p) / sts(p, p);
  n.sts -= sts(p, p) * instead * instead.transpose();
  n.str -= str[p] * instead;
  course->ahead.setConstant(1, str[p] / sts(p, p));
  course->by_parameter = instead.transpose();
}

NormalEquations nothing_of(Eigen::Index parameters) {
  NormalEquations n;
  n.sts.setZero(parameters, parameters);
  n.str.setZero(parameters);
  n.str_of_step.setZero(parameters);
  n.rounding.setZero(parameters, parameters);
  return n;
}

/// Blocks of one piece, of two, four ...
Blocks blocks_of(const std::map<long, Block>& pieces) {
  Blocks blocks;
  for (std::size_t doubled = 0; doubled < blocks.size(); ++doubled) {
    long last = -1;
    for (const auto& [piece, part] : pieces) {
      const long block = piece >> doubled;
      if (block != last) blocks[doubled].emplace_back();
      blocks[doubled].back() += part;
      last = block;
    }
  }
  return blocks;
}

/// Sums what readings say as they come, observation by observation, and what judges an optimum: an hour's
/// sensitivities are never held.
class ReadingSums {
 public:
  /// @param length [s] of the shortest pieces; absent: nothing is judged
  /// @param finer residuals of a simulation in half steps; empty: not asked
  ReadingSums(const Record& record, std::optional<double> length, std::span<const Residuals> finer,
              NormalEquations& sums)
      : record_(record), length_(length), finer_(finer), sums_(sums), each_(record.observations.size()) {}

  /// @param first of some readings of an observation in a row, in their order
  void add(std::size_t observation, Eigen::Index first, const Eigen::VectorXd& left, const Eigen::MatrixXd& s) {
    sums_.rtr += left.squaredNorm();
    if (s.size() == 0) return;
    sums_.sts += gram(s);
    sums_.str += transposed_product(s, left);
    if (!length_) return;
    OfOne& one = each_[observation];
    one.informed = one.informed || !s.isZero(0);
    const Observation& o = record_.observations[observation];
    for_each_piece(record_, o, first, left.size(), *length_, [&](long piece, Eigen::Index begin, Eigen::Index rows) {
      const Eigen::MatrixXd part = s.middleRows(begin - first, rows);
      one.pieces[piece] += {gram(part), transposed_product(part, left.segment(begin - first, rows))};
    });
    add_rounding(o, one, first, s);
    if (finer_.empty()) return;
    constexpr double second_order = 4.0 / 3;  // half steps show three quarters of the error
    sums_.str_of_step +=
        second_order * transposed_product(s, finer_[observation].value.segment(first, left.size()) - left);
  }

  /// The parts of each piece, of the observations that some parameter moves.
  std::map<long, Block> pieces() const {
    std::map<long, Block> all;
    for (const OfOne& one : each_) {
      if (!one.informed) continue;
      for (const auto& [piece, part] : one.pieces) all[piece] += part;
    }
    return all;
  }

 private:
  struct OfOne {
    bool informed = false;
    std::map<long, Block> pieces;
    std::size_t stretch = 0;  ///< of Observation::rounded, the one that comes or is under way
    Eigen::VectorXd sum;      ///< of its rows so far
  };

  /// An error that is the same throughout a stretch moves Sᵀr by the sum of its rows of S; were it another in each
  /// reading, their squares would add up.
  void add_rounding(const Observation& o, OfOne& one, Eigen::Index first, const Eigen::MatrixXd& s) {
    const auto from = static_cast<std::size_t>(first), until = from + static_cast<std::size_t>(s.rows());
    for (; one.stretch < o.rounded.size(); ++one.stretch) {
      const EqualReadings& same = o.rounded[one.stretch];
      const std::size_t begin = std::max(same.begin, from), end = std::min(same.end, until);
      if (begin >= end) return;
      const Eigen::MatrixXd rows =
          s.middleRows(static_cast<Eigen::Index>(begin - from), static_cast<Eigen::Index>(end - begin));
      if (begin == same.begin) one.sum.setZero(s.cols());
      one.sum += rows.colwise().sum().transpose();
      sums_.rounding -= gram(rows);
      if (end < same.end) return;  // it goes on in the readings to come
      sums_.rounding += one.sum * one.sum.transpose();
    }
  }

  const Record& record_;
  std::optional<double> length_;
  std::span<const Residuals> finer_;
  NormalEquations& sums_;
  std::vector<OfOne> each_;
};

}  // namespace

Block& Block::operator+=(const Block& other) {
  if (str.size() == 0) return *this = other;
  sts += other.sts;
  str += other.str;
  return *this;
}

NormalEquations& NormalEquations::operator+=(const NormalEquations& other) {
  sts += other.sts;
  str += other.str;
  str_of_step += other.str_of_step;
  rounding += other.rounding;
  rtr += other.rtr;
  for (std::size_t b = 0; b < blocks.size(); ++b)
    blocks[b].insert(blocks[b].end(), other.blocks[b].begin(), other.blocks[b].end());
  return *this;
}

FitProblem::FitProblem(std::span<const Record> records, const Model& model, const CalibrationOptions& options)
    : records_(records),
      model_(model),
      options_(options),
      free_(model),
      moved_(moved_by(free_)),
      shortest_piece_(shortest_piece(records)),
      followed_{.phases = options.phases} {
  for (const std::size_t place : free_.places()) {
    const Parameter& p = model.at(place);
    const EffectParameter* known = model.known_of(place);
    const bool is_supply = known != nullptr && known->role == Role::supply;
    if (!p.prior && !is_supply) continue;
    priors_.push_back(
        {static_cast<Eigen::Index>(*free_.mover(place)), p.prior ? *p.prior : known_of_supply(records, model)});
  }
}

bool FitProblem::finds_better_phases(std::span<const double> x, double share) const {
  if (!options_.phases.empty()) return false;
  const Followed before = followed_;
  search_phases();
  if (normal_equations(x, false, false).rtr < (1 - share) * before.cost) return true;
  followed_ = before;
  return false;
}

bool FitProblem::courses_are_sure(std::span<const double> x) const {
  const Eigen::VectorXd change = change_to(x);
  return std::ranges::all_of(followed_.courses, [&](const PhaseCourse& course) { return course.is_sure(change); });
}

Eigen::VectorXd FitProblem::change_to(std::span<const double> x) const {
  using Values = Eigen::Map<const Eigen::VectorXd>;
  const auto p = static_cast<Eigen::Index>(x.size());
  return Values(x.data(), p) - Values(followed_.x.data(), p);
}

RotorPhase FitProblem::phase_after(std::size_t i, const Eigen::VectorXd& change) const {
  const PhaseCourse& course = followed_.courses[i];
  return course.known() ? course.from(records_[i], followed_.phases[i], change) : followed_.phases[i];
}

NormalEquations FitProblem::of_record(std::size_t i, std::span<const double> values, bool with_sensitivities,
                                      bool to_judge, const RotorPhase& phase, PhaseCourse& course) const {
  const Record& record = records_[i];
  const bool in_steps = to_judge && !options_.quick_errors;
  const auto p = static_cast<Eigen::Index>(free_.size());
  const auto moved = with_sensitivities ? std::span(moved_) : std::span<const std::vector<std::size_t>>{};
  NormalEquations n = nothing_of(p);
  const ModelStructure structure = record.structure(model_);
  n.rtr += phase.unlikely;
  const bool turned = phase.at.size() == 1;  // the same throughout: one parameter more
  if (!to_judge && phase.at.size() <= 1 && moved.size() + (turned ? 1 : 0) <= PassSums::most) {
    std::vector<double> all(values.begin(), values.end());
    std::vector<std::vector<std::size_t>> columns(moved.begin(), moved.end());
    if (turned) {
      all.push_back(phase.at.front());
      if (with_sensitivities) columns.push_back({values.size()});
    }
    add(n, summed_pass(record, structure, all, columns, wanted_of(record, options_)), with_sensitivities,
        turned ? &course : nullptr);
    if (turned && with_sensitivities) course.longest = longest_move(structure, values);
    return n;
  }
  std::vector<Residuals> finer;
  if (in_steps) finer = residuals_at_phase(record, structure, values, {}, phase, StepLength::half).residuals;
  ReadingSums sums(record, to_judge ? std::optional(shortest_piece_) : std::nullopt, finer, n);
  const auto take = [&](std::size_t s, Eigen::Index first, const Eigen::VectorXd& left, const Eigen::MatrixXd& by) {
    if (wanted(record.observations[s].signal, options_)) sums.add(s, first, left, by);
  };
  if (phase.at.empty() && moved.size() <= 2 * derivatives_per_pass) {
    visit_simulated_residuals(record, structure, values, moved, take);
  } else {
    ResidualsAtPhase seen = residuals_at_phase(record, structure, values, moved, phase);
    course = std::move(seen.course);
    if (seen.prior.sts.size() > 0) {
      n.sts += seen.prior.sts;
      n.str += seen.prior.str;
    }
    for (std::size_t s = 0; s < seen.residuals.size(); ++s)
      take(s, 0, seen.residuals[s].value, seen.residuals[s].sensitivity);
  }
  if (to_judge) n.blocks = blocks_of(sums.pieces());
  return n;
}

std::vector<NormalEquations> FitProblem::of_each(std::span<const double> x, bool with_sensitivities, bool to_judge,
                                                 bool by_courses) const {
  const std::vector<double> values = free_.spread(x);
  std::vector<NormalEquations> each(records_.size());
  std::vector<PhaseCourse> courses(records_.size());
  RotorPhases phases(records_.size());
  const RotorPhases& near = followed_.phases;
  const Eigen::VectorXd change = by_courses ? change_to(x) : Eigen::VectorXd();
  parallel_for(records_, [&](std::size_t i) {
    phases[i] = by_courses
                    ? phase_after(i, change)
                    : best_phase(records_[i], records_[i].structure(model_), values, near.empty() ? nullptr : &near[i]);
    each[i] = of_record(i, values, with_sensitivities, to_judge, phases[i], courses[i]);
  });
  const double cost = sum_of(each, x).rtr;
  if (cost <= followed_.cost) {  // a step that was too long may have left the valley: it is not followed
    if (!with_sensitivities || !model_.periodic()) courses.clear();
    followed_ = {std::move(phases), {x.begin(), x.end()}, std::move(courses), cost};
  }
  return each;
}

std::vector<NormalEquations> FitProblem::of_each(std::span<const double> x, bool with_sensitivities) const {
  return of_each(x, with_sensitivities, false, !followed_.courses.empty());
}

NormalEquations FitProblem::sum_of(std::span<const NormalEquations> each, std::span<const double> x) const {
  NormalEquations sum = nothing_of(static_cast<Eigen::Index>(free_.size()));
  for (const NormalEquations& record : each) sum += record;
  for (const auto& [column, prior] : priors_) {
    const double r = (prior.value - x[static_cast<std::size_t>(column)]) / prior.std;
    sum.sts(column, column) += 1 / (prior.std * prior.std);
    sum.str[column] += r / prior.std;
    sum.rtr += r * r;
  }
  return sum;
}

NormalEquations FitProblem::normal_equations(std::span<const double> x, bool with_sensitivities, bool to_judge) const {
  const bool by_courses = !followed_.courses.empty();
  const bool sure = !by_courses || courses_are_sure(x);
  const NormalEquations sum = sum_of(of_each(x, with_sensitivities, to_judge, by_courses), x);
  if (sure || sum.rtr <= followed_.cost) return sum;
  // What is linear may have failed the phases, not the step.
  return sum_of(of_each(x, with_sensitivities, to_judge, false), x);
}

}  // namespace emtb
