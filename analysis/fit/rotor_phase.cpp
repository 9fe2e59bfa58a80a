#include "analysis/fit/rotor_phase.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>

#include "analysis/fit/phase_equations.h"
#include "analysis/fit/phase_knots.h"
#include "analysis/fit/phase_search.h"
#include "analysis/fit/summed_pass.h"
#include "analysis/numerics/linear_algebra.h"
#include "analysis/numerics/parallel.h"

namespace emtb {
namespace {

using Eigen::VectorXd;

/// The residuals with the rotor turned; a column that moves the place after the values is the phase's, the same
/// throughout.
std::vector<Residuals> residuals_turned_by(const Record& record, const ModelStructure& structure,
                                           std::span<const double> values,
                                           std::span<const std::vector<std::size_t>> columns, const Knots& knots,
                                           const RotorPhase& phase, Variation variation = {}) {
  std::vector<double> all(values.begin(), values.end());
  all.push_back(knots.count() == 1 ? phase.at.front() : 0);
  if (knots.count() == 1) return simulated_residuals(record, structure, all, columns, variation);
  const Excitation& x = record.excitation;
  std::vector<double> angle = x.angle;
  for (std::size_t k = 0; k < x.t.size(); ++k) {
    const auto [knot, share] = knots.of(x.t[k]);
    angle[k] += phase.at[knot] + share * (phase.at[knot + 1] - phase.at[knot]);
  }
  variation.angle = angle;
  return simulated_residuals(record, structure, all, columns, variation);
}

/// The residuals with the sensitivity to one more column: the phase.
std::vector<Residuals> with_phase(const Record& record, const ModelStructure& structure, std::span<const double> values,
                                  std::span<const std::vector<std::size_t>> moved, const Knots& knots,
                                  const RotorPhase& phase) {
  std::vector<std::vector<std::size_t>> columns(moved.begin(), moved.end());
  columns.push_back({values.size()});
  return residuals_turned_by(record, structure, values, columns, knots, phase);
}

/// The column of a phase, divided between the knots that each reading lies between; readings between the same two
/// knots follow each other.
class PhaseColumn {
 public:
  /// @param r the phase's column comes last
  PhaseColumn(const Residuals& r, std::span<const Knots::Place> places, bool many)
      : low_(r.sensitivity.rightCols(1)), high_(VectorXd::Zero(many ? low_.size() : 0)) {
    const auto end = static_cast<Eigen::Index>(places.size());
    for (Eigen::Index i = 0; i < end; ++i) {
      const auto [knot, share] = places[static_cast<std::size_t>(i)];
      if (stretches_.empty() || stretches_.back().knot != knot) stretches_.push_back({knot, i, 0});
      ++stretches_.back().count;
      if (!many) continue;
      high_[i] = share * low_[i];
      low_[i] *= 1 - share;
    }
  }

  /// Adds its products with another column, knot by knot.
  void add_products(const Eigen::Ref<const VectorXd>& column, std::span<double> sums) const {
    for (const auto& [knot, begin, count] : stretches_) {
      sums[knot] += low_.segment(begin, count).dot(column.segment(begin, count));
      if (high_.size() > 0) sums[knot + 1] += high_.segment(begin, count).dot(column.segment(begin, count));
    }
  }

  /// Takes it out of another column, so many times at each knot.
  void take_out(std::span<const double> times, Eigen::Ref<VectorXd> column) const {
    for (const auto& [knot, begin, count] : stretches_) {
      column.segment(begin, count) -= times[knot] * low_.segment(begin, count);
      if (high_.size() > 0) column.segment(begin, count) -= times[knot + 1] * high_.segment(begin, count);
    }
  }

 private:
  struct Stretch {
    std::size_t knot;
    Eigen::Index begin, count;
  };
  VectorXd low_, high_;  ///< of the knot before each reading, and of the one after it
  std::vector<Stretch> stretches_;
};

/// Takes out of the other columns what the last one, the phase, does instead, and drops it.
ResidualsAtPhase project_off_phase(std::vector<Residuals> out, const Knots& knots, const RotorPhase& phase) {
  const std::span<const double> at = phase.at;
  PhaseEquations equations(knots, at);
  Eigen::Index parameters = 0;
  const bool many = at.size() > 1;
  std::vector<std::optional<PhaseColumn>> columns(out.size());
  for (std::size_t s = 0; s < out.size(); ++s) {
    if (!out[s].informed()) continue;
    parameters = out[s].sensitivity.cols() - 1;
    const std::vector<Knots::Place> places = knots.of(out[s]);
    equations.add(out[s], places);
    columns[s].emplace(out[s], places, many);
  }
  const auto count = static_cast<Eigen::Index>(at.size());
  PhaseCourse course;
  if (equations.informed()) {
    const std::vector<double> step = equations.step();
    course.ahead = Eigen::Map<const Eigen::VectorXd>(step.data(), count);
    course.by_parameter.setZero(count, parameters);
  }
  for (Eigen::Index j = 0; equations.informed() && j < parameters; ++j) {
    std::vector<double> shared(at.size(), 0.0);
    for (std::size_t s = 0; s < out.size(); ++s) {
      if (columns[s]) columns[s]->add_products(out[s].sensitivity.col(j), shared);
    }
    const std::vector<double> instead = equations.solved(std::move(shared));
    for (std::size_t s = 0; s < out.size(); ++s) {
      if (columns[s]) columns[s]->take_out(instead, out[s].sensitivity.col(j));
    }
    course.by_parameter.col(j) = Eigen::Map<const Eigen::VectorXd>(instead.data(), count);
  }
  for (Residuals& r : out) {
    if (r.informed()) r.sensitivity.conservativeResize(Eigen::NoChange, parameters);
  }
  if (!many || !course.known()) return {std::move(out), {}, std::move(course)};
  const auto changes_of = [](const auto& knots_of) {  // from knot to knot
    const Eigen::Index n = knots_of.rows() - 1;
    return (knots_of.bottomRows(n) - knots_of.topRows(n)).eval();
  };
  const Eigen::MatrixXd changed = changes_of(course.by_parameter);
  const Eigen::VectorXd change = changes_of(Eigen::Map<const Eigen::VectorXd>(at.data(), count));
  return {std::move(out),
          {knots.stiffness() * gram(changed), knots.stiffness() * transposed_product(changed, change)},
          std::move(course)};
}

constexpr double sure = 0.2;  // of the longest move: what is linear holds, and the step needs no proof

/// A phase on its way to where the record fits best, a simulation at a time: Gauss and Newton, a step that does not
/// help halved.
class Follower {
 public:
  /// @param longest [rad] of a step
  Follower(const Record& record, const ModelStructure& structure, std::span<const double> values, const Knots& knots,
           RotorPhase start, double longest)
      : record_(record),
        structure_(structure),
        values_(values),
        knots_(knots),
        longest_(longest),
        phase_(std::move(start)),
        step_(phase_.at.size(), 0.0) {}

  /// Simulates the next step, at first the start.
  void look() {
    if (done_) return;
    const RotorPhase tried = stepped();
    const std::vector<Residuals> seen = with_phase(record_, structure_, values_, {}, knots_, tried);
    const double cost = sum_of_squares(seen) + tried.unlikely;
    if (cost > cost_) {
      for (double& s : step_) s *= 0.5;
      promised_ *= 0.5;
      return;
    }
    cost_ = cost;
    phase_ = tried;
    const PhaseEquations equations = equations_of(seen, knots_, phase_.at);
    step_ = equations.informed() ? equations.step() : std::vector<double>(step_.size(), 0.0);
    double largest = 0;
    for (double& s : step_) {
      s = std::clamp(s, -longest_, longest_);
      largest = std::max(largest, std::abs(s));
    }
    promised_ = equations.gain(step_);
    done_ = largest < sure * longest_;
  }
  void look(int times) {
    for (int k = 0; k < times; ++k) look();
  }

  double expected() const { return cost_ - promised_; }  ///< cost after the next step
  RotorPhase phase() const { return done_ ? stepped() : phase_; }

 private:
  RotorPhase stepped() const {
    RotorPhase there = phase_;
    for (std::size_t i = 0; i < step_.size(); ++i) there.at[i] += step_[i];
    there.unlikely = knots_.unlikely(there.at);
    return there;
  }

  const Record& record_;
  const ModelStructure& structure_;
  std::span<const double> values_;
  const Knots& knots_;
  double longest_;
  RotorPhase phase_;
  std::vector<double> step_;
  double cost_ = std::numeric_limits<double>::infinity(), promised_ = 0;
  bool done_ = false;
};

/// The one of some phases from which the record fits best in the end. All are looked at, two of them more closely.
RotorPhase best_followed(const Record& record, const ModelStructure& structure, std::span<const double> values,
                         const Knots& knots, const std::vector<RotorPhase>& from, double longest) {
  constexpr std::size_t closely = 2;
  constexpr int looks = 2, to_the_end = 8;
  std::vector<Follower> ways;
  for (const RotorPhase& phase : from) ways.emplace_back(record, structure, values, knots, phase, longest);
  parallel_for(ways.size(), [&](std::size_t k) { ways[k].look(); });
  std::vector<std::size_t> order(ways.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t k) { return ways[k].expected(); });
  if (order.size() > closely) order.resize(closely);
  parallel_for(order.size(), [&](std::size_t i) { ways[order[i]].look(looks); });
  Follower& best = ways[*std::ranges::min_element(order, {}, [&](std::size_t k) { return ways[k].expected(); })];
  best.look(to_the_end);
  return best.phase();
}

/// The places in a turn that are looked at.
struct Places {
  double period = 0;                                 ///< [rad] of the slowest wave
  int steps = 0;                                     ///< in it
  double longest() const { return period / steps; }  ///< [rad] from one to the next
};

Places places_of(const PeriodicPart& slowest, const PeriodicPart& fastest) {
  return {2 * std::numbers::pi / slowest.order,
          8 * static_cast<int>(std::lround(std::max(1.0, fastest.order / slowest.order)))};
}

/// What is left at a phase that does not change in the course of the record, or where there is none, and what one more
/// of it would do.
PassSums sums_at(const Record& record, const ModelStructure& structure, std::span<const double> values,
                 const RotorPhase& phase, bool with_sensitivity) {
  std::vector<double> all(values.begin(), values.end());
  if (!phase.at.empty()) all.push_back(phase.at.front());
  const std::vector<std::vector<std::size_t>> columns(with_sensitivity ? 1 : 0, {values.size()});
  return summed_pass(record, structure, all, columns, std::vector<char>(record.observations.size(), 1));
}

/// A phase that does not change in the course of the record, some steps of Gauss and Newton on: nearly linear, so none
/// needs to be proved.
RotorPhase stepped_to(const Record& record, const ModelStructure& structure, std::span<const double> values,
                      RotorPhase phase, int steps, double longest) {
  for (int k = 0; k < steps; ++k) {
    const PassSums sums = sums_at(record, structure, values, phase, true);
    if (!(sums.sts[0] > 0)) break;
    phase.at.front() += std::clamp(sums.str[0] / sums.sts[0], -longest, longest);
  }
  return phase;
}

}  // namespace

RotorPhase best_phase(const Record& record, const ModelStructure& structure, std::span<const double> values,
                      const RotorPhase* near) {
  if (near != nullptr && near->at.empty()) near = nullptr;
  const std::vector<PeriodicPart> parts = periodic_parts(structure, values);
  if (parts.empty()) return {};
  const auto [slowest, fastest] = std::ranges::minmax(parts, {}, &PeriodicPart::order);
  const Knots knots(record, near != nullptr ? near->at.size() : Knots::wanted(record, fastest.order));
  const Places places = places_of(slowest, fastest);
  const double longest = places.longest();
  const bool many = knots.count() > 1;
  if (near != nullptr && many) {
    constexpr int looks = 2;
    Follower follower(record, structure, values, knots, *near, longest);
    follower.look(looks);
    return follower.phase();
  }
  if (near != nullptr) return stepped_to(record, structure, values, *near, 1, longest);
  // There is a valley for each period of the fastest; what is linear tells the lowest of them, near enough. Where the
  // shaft stops it tells little: there a phase that hardly changes may be the better one.
  constexpr double hardly = 100;
  const WavesOfPhase waves(record, structure, values, parts, knots);
  std::vector<RotorPhase> phases = likely_phases(waves, knots, places.period, places.steps, 1);
  if (many) {
    for (RotorPhase& stiffer : likely_phases(waves, knots, places.period, places.steps, hardly)) {
      if (std::ranges::find(phases, stiffer.at, &RotorPhase::at) == phases.end()) phases.push_back(std::move(stiffer));
    }
    return best_followed(record, structure, values, knots, phases, longest);
  }
  constexpr double diverges = std::numeric_limits<double>::infinity();
  std::vector<double> costs(phases.size());
  parallel_for(phases.size(), [&](std::size_t k) {
    const double cost = sums_at(record, structure, values, phases[k], false).rtr;
    costs[k] = cost < diverges ? cost : diverges;
  });
  const auto best = static_cast<std::size_t>(std::ranges::min_element(costs) - costs.begin());
  return stepped_to(record, structure, values, std::move(phases[best]), 2, longest);
}

ResidualsAtPhase residuals_at_phase(const Record& record, const ModelStructure& structure,
                                    std::span<const double> values, std::span<const std::vector<std::size_t>> moved,
                                    const RotorPhase& phase, StepLength steps) {
  const Variation variation{.angle = {}, .half_steps = steps == StepLength::half};
  if (phase.at.empty()) return {simulated_residuals(record, structure, values, moved, variation), {}, {}};
  const Knots knots(record, phase.at.size());
  if (moved.empty()) return {residuals_turned_by(record, structure, values, {}, knots, phase, variation), {}, {}};
  ResidualsAtPhase out = project_off_phase(with_phase(record, structure, values, moved, knots, phase), knots, phase);
  out.course.longest = longest_move(structure, values);
  return out;
}

double longest_move(const ModelStructure& structure, std::span<const double> values) {
  const std::vector<PeriodicPart> parts = periodic_parts(structure, values);
  const auto [slowest, fastest] = std::ranges::minmax(parts, {}, &PeriodicPart::order);
  return places_of(slowest, fastest).longest();
}

Eigen::VectorXd PhaseCourse::move(const Eigen::VectorXd& change) const {
  return (ahead - product(by_parameter, Eigen::MatrixXd(change))).cwiseMax(-longest).cwiseMin(longest);
}

bool PhaseCourse::is_sure(const Eigen::VectorXd& change) const {
  return !known() || move(change).cwiseAbs().maxCoeff() < sure * longest;
}

RotorPhase PhaseCourse::from(const Record& record, const RotorPhase& phase, const Eigen::VectorXd& change) const {
  const Eigen::VectorXd moves = move(change);
  RotorPhase there = phase;
  for (std::size_t k = 0; k < there.at.size(); ++k) there.at[k] += moves[static_cast<Eigen::Index>(k)];
  there.unlikely = Knots(record, there.at.size()).unlikely(there.at);
  return there;
}

ResidualsAtPhases residuals_at_best_phases(std::span<const Record> records, const Model& model,
                                           std::span<const double> values,
                                           std::span<const std::vector<std::size_t>> moved,
                                           std::span<const RotorPhase> near) {
  ResidualsAtPhases out{RotorPhases(records.size()), {}};
  std::vector<std::vector<Residuals>> each(records.size());
  const auto one = [&](std::size_t i) {
    const ModelStructure structure = records[i].structure(model);
    out.phases[i] = best_phase(records[i], structure, values, near.empty() ? nullptr : &near[i]);
    each[i] = residuals_at_phase(records[i], structure, values, moved, out.phases[i]).residuals;
    for (Residuals& r : each[i]) r.record = i;
  };
  parallel_for(records, one);
  for (auto& of_one : each) std::ranges::move(of_one, std::back_inserter(out.residuals));
  return out;
}

SquaresAtPhases squares_at_best_phases(std::span<const Record> records, const Model& model,
                                       std::span<const RotorPhase> near) {
  SquaresAtPhases out{RotorPhases(records.size())};
  std::vector<double> each(records.size());
  const std::vector<double> values = model.values();
  parallel_for(records, [&](std::size_t i) {
    const ModelStructure structure = records[i].structure(model);
    out.phases[i] = best_phase(records[i], structure, values, near.empty() ? nullptr : &near[i]);
    each[i] = out.phases[i].at.size() > 1
                  ? sum_of_squares(residuals_at_phase(records[i], structure, values, {}, out.phases[i]).residuals)
                  : sums_at(records[i], structure, values, out.phases[i], false).rtr;
  });
  out.squares = std::accumulate(each.begin(), each.end(), 0.0);
  return out;
}

}  // namespace emtb
