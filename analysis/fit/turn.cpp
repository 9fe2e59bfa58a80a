#include "analysis/fit/turn.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "analysis/numerics/linear_algebra.h"
#include "analysis/numerics/parallel.h"
#include "model/catalogue.h"

namespace emtb {
namespace {

constexpr double knot_interval = 0.5;  // [s]: noise of 0.3 rad/s at 1 kHz lets the angle wander 0.007 rad in it

/// An effect of a structure that repeats with the angle.
struct PeriodicPart {
  std::size_t index = 0;  ///< among the structure's effects
  std::size_t place = 0;  ///< of its amplitude among the values; its phase comes last of its parameters
  std::size_t count = 0;  ///< of its parameters
  double order = 1;       ///< how often a turn it repeats
};

std::vector<PeriodicPart> periodic_parts(const ModelStructure& structure, std::span<const double> values) {
  std::vector<PeriodicPart> parts;
  std::size_t place = ModelStructure::base_count;
  for (std::size_t k = 0; k < structure.effects.size(); ++k) {
    const EffectInfo& info = effect_catalogue()[structure.effects[k]];
    if (info.periodic) {
      const auto order = info.order_place();
      parts.push_back({k, place, info.parameter_count, order ? values[place + *order] : 1});
    }
    place += info.parameter_count;
  }
  return parts;
}

/// Knots evenly spread over a run, and where each reading lies between them.
class Knots {
 public:
  Knots(const PreparedRun& record, std::size_t count) : record_(record), count_(std::max<std::size_t>(1, count)) {
    const std::vector<double>& t = record.excitation.t;
    start_ = t.front();
    if (count_ < 2) return;
    interval_ = (t.back() - start_) / static_cast<double>(count_ - 1);
    stiffness_ = 1 / (record.angle_wander * interval_);
  }

  /// As many as an effect of an order needs: one where the wander puts it off by little in all of the run.
  static std::size_t wanted(const PreparedRun& record, double order) {
    constexpr double little = 0.5;  // [rad] of its period
    const double span = record.excitation.t.back() - record.excitation.t.front();
    if (order * std::sqrt(record.angle_wander * span) < little || span < knot_interval) return 1;
    return static_cast<std::size_t>(std::ceil(span / knot_interval)) + 1;
  }

  std::size_t count() const { return count_; }
  /// 1 / variance of the change from one knot to the next [1/rad^2].
  double stiffness() const { return stiffness_; }

  /// A time between the knots `knot` and `knot + 1`, nearer to the latter by `share`; a lone knot counts everywhere.
  struct Place {
    std::size_t knot = 0;
    double share = 0;
  };
  Place of(double t) const {
    if (count_ < 2) return {};
    const double at = std::clamp((t - start_) / interval_, 0.0, static_cast<double>(count_ - 1));
    const std::size_t knot = std::min(static_cast<std::size_t>(at), count_ - 2);
    return {knot, at - static_cast<double>(knot)};
  }
  std::vector<Place> of(const Residuals& r) const {
    const Observation& o = *std::ranges::find(record_.observations, r.signal, &Observation::signal);
    const std::vector<double>& t = record_.excitation.t;
    std::vector<Place> places;
    places.reserve(o.size());
    for (std::size_t i = 0; i < o.size(); ++i) places.push_back(of(0.5 * (t[o.first[i]] + t[o.last[i]])));
    return places;
  }

 private:
  const PreparedRun& record_;
  std::size_t count_ = 1;
  double start_ = 0, interval_ = 0, stiffness_ = 0;
};

double unlikely(const Knots& knots, std::span<const double> at) {
  double squares = 0;
  for (std::size_t k = 1; k < at.size(); ++k) squares += std::pow(at[k] - at[k - 1], 2);
  return knots.stiffness() * squares;
}

/// The residuals with the rotor turned; a column that moves the place after the values is the turn's, the same
/// throughout.
std::vector<Residuals> turned_residuals(const PreparedRun& record, const ModelStructure& structure,
                                        std::span<const double> values,
                                        std::span<const std::vector<std::size_t>> columns, const Knots& knots,
                                        const Turn& turn) {
  std::vector<double> all(values.begin(), values.end());
  all.push_back(knots.count() == 1 ? turn.at.front() : 0);
  if (knots.count() == 1) return simulated_residuals(record, structure, all, columns);
  PreparedRun turned = record;
  Excitation& x = turned.excitation;
  for (std::size_t k = 0; k < x.t.size(); ++k) {
    const auto [knot, share] = knots.of(x.t[k]);
    x.angle[k] += turn.at[knot] + share * (turn.at[knot + 1] - turn.at[knot]);
  }
  return simulated_residuals(turned, structure, all, columns);
}

/// The residuals with the sensitivity to one more column: the turn.
std::vector<Residuals> with_turn(const PreparedRun& record, const ModelStructure& structure,
                                 std::span<const double> values, std::span<const std::vector<std::size_t>> moved,
                                 const Knots& knots, const Turn& turn) {
  std::vector<std::vector<std::size_t>> columns(moved.begin(), moved.end());
  columns.push_back({values.size()});
  return turned_residuals(record, structure, values, columns, knots, turn);
}

/// The equations of the turn at the knots: a little more at one of them moves what is read around it as the same turn
/// throughout would, for the machine soon forgets where its rotor stood. Tridiagonal.
class TurnEquations {
 public:
  TurnEquations(const Knots& knots, std::span<const double> at)
      : diagonal_(at.size(), 0.0), beside_(at.size(), 0.0), gradient_(at.size(), 0.0) {
    for (std::size_t k = 0; k + 1 < at.size(); ++k) {
      const double stiffness = knots.stiffness(), change = at[k + 1] - at[k];
      diagonal_[k] += stiffness;
      diagonal_[k + 1] += stiffness;
      beside_[k] -= stiffness;
      gradient_[k] += stiffness * change;
      gradient_[k + 1] -= stiffness * change;
    }
  }

  /// @param r its last column the sensitivity to the turn
  void add(const Residuals& r, std::span<const Knots::Place> places) {
    const auto turn = r.sensitivity.rightCols<1>();
    const bool many = diagonal_.size() > 1;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto [knot, share] = places[i];
      const double s = turn.data()[i], here = (1 - share) * s, next = share * s, left = r.value.data()[i];
      diagonal_[knot] += here * here;
      gradient_[knot] += here * left;
      information_ += s * s;
      if (!many) continue;
      diagonal_[knot + 1] += next * next;
      beside_[knot] += here * next;
      gradient_[knot + 1] += next * left;
    }
  }

  bool informed() const { return information_ > 0; }
  /// What a step takes off the sum of squares.
  double gain(std::span<const double> step) const {
    double gain = 0;
    for (std::size_t k = 0; k < step.size(); ++k) {
      gain += step[k] * (2 * gradient_[k] - diagonal_[k] * step[k]);
      if (k > 0) gain -= 2 * beside_[k - 1] * step[k - 1] * step[k];
    }
    return gain;
  }
  std::vector<double> step() const { return solved(gradient_); }

  /// The changes of the knots that bring forth a right-hand side (elimination after Thomas).
  std::vector<double> solved(std::vector<double> x) const {
    std::vector<double> pivot(diagonal_);
    for (std::size_t k = 1; k < pivot.size(); ++k) {
      const double factor = beside_[k - 1] / pivot[k - 1];
      pivot[k] -= factor * beside_[k - 1];
      x[k] -= factor * x[k - 1];
    }
    for (std::size_t k = pivot.size(); k-- > 0;) {
      if (k + 1 < pivot.size()) x[k] -= beside_[k] * x[k + 1];
      x[k] /= pivot[k];
    }
    return x;
  }

 private:
  std::vector<double> diagonal_, beside_, gradient_;
  double information_ = 0;
};

TurnEquations equations_of(std::span<const Residuals> seen, const Knots& knots, std::span<const double> at) {
  TurnEquations equations(knots, at);
  for (const Residuals& r : seen) {
    if (r.informed()) equations.add(r, knots.of(r));
  }
  return equations;
}

/// What waves of unit amplitude, in phase and a quarter of a period later, would do to a record in which nothing
/// repeats with the angle, to first order: with these, the cost at any turn is a quadratic form of its sines and
/// cosines, from knot to knot, and no turn needs a simulation of its own.
class WavesOfTurn {
 public:
  WavesOfTurn(const PreparedRun& record, const ModelStructure& structure, std::span<const double> values,
              std::span<const PeriodicPart> parts, const Knots& knots)
      : parts_(parts.begin(), parts.end()) {
    ModelStructure doubled = structure;
    std::vector<double> still(values.begin(), values.end());
    std::vector<std::vector<std::size_t>> amplitudes(2 * parts_.size());
    for (std::size_t k = parts_.size(); k-- > 0;) {  // from the back: the places before stay as they are
      const PeriodicPart& part = parts_[k];
      amplitudes_.insert(amplitudes_.begin(), still[part.place]);
      still[part.place] = 0;
      const auto begin = still.begin() + static_cast<std::ptrdiff_t>(part.place);
      std::vector<double> later(begin, begin + static_cast<std::ptrdiff_t>(part.count));
      later.back() += std::numbers::pi / 2;
      still.insert(begin + static_cast<std::ptrdiff_t>(part.count), later.begin(), later.end());
      const auto effect = doubled.effects.begin() + static_cast<std::ptrdiff_t>(part.index);
      doubled.effects.insert(effect, *effect);
      const std::size_t before = part.place + shift(k);
      amplitudes[2 * k] = {before};
      amplitudes[2 * k + 1] = {before + part.count};
    }
    const auto columns = static_cast<Eigen::Index>(amplitudes.size());
    pieces_.resize(std::max<std::size_t>(1, knots.count() - 1),
                   {Eigen::MatrixXd::Zero(columns, columns), Eigen::VectorXd::Zero(columns)});
    for (const Residuals& r : simulated_residuals(record, doubled, still, amplitudes)) {
      if (!r.informed()) continue;
      const std::vector<Knots::Place> places = knots.of(r);
      for (std::size_t begin = 0, end = 0; begin < places.size(); begin = end) {
        while (end < places.size() && places[end].knot == places[begin].knot) ++end;
        const auto from = static_cast<Eigen::Index>(begin), rows = static_cast<Eigen::Index>(end - begin);
        Piece& piece = pieces_[places[begin].knot];
        piece.information += gram(r.sensitivity.middleRows(from, rows));
        piece.gradient += transposed_product(r.sensitivity.middleRows(from, rows), r.value.segment(from, rows));
      }
    }
  }

  std::size_t pieces() const { return pieces_.size(); }

  /// The cost of what is read between a knot and the next, less that without any wave.
  double cost(std::size_t piece, double turn) const {
    const auto& [information, gradient] = pieces_[piece];
    Eigen::VectorXd size(gradient.size());
    for (std::size_t k = 0; k < parts_.size(); ++k) {
      const auto column = static_cast<Eigen::Index>(2 * k);
      size[column] = amplitudes_[k] * std::cos(parts_[k].order * turn);
      size[column + 1] = amplitudes_[k] * std::sin(parts_[k].order * turn);
    }
    return size.dot(information * size) - 2 * size.dot(gradient);
  }

 private:
  struct Piece {
    Eigen::MatrixXd information;
    Eigen::VectorXd gradient;
  };

  /// How many values the parts before the k-th have been doubled by.
  std::size_t shift(std::size_t k) const {
    std::size_t sum = 0;
    for (std::size_t i = 0; i < k; ++i) sum += parts_[i].count;
    return sum;
  }

  std::vector<PeriodicPart> parts_;
  std::vector<double> amplitudes_;
  std::vector<Piece> pieces_;
};

/// The turns that are likely by the waves, at most a few, the best first: the cheapest path over a grid of turns from
/// knot to knot (Viterbi), to each valley at the end.
/// @param steps of the grid in the period of the slowest @param stiffer than the wander of the angle asks for
std::vector<Turn> likely_turns(const WavesOfTurn& waves, const Knots& knots, double period, int steps, double stiffer) {
  constexpr std::size_t looked_at = 3;
  const auto n = static_cast<std::size_t>(steps);
  const double width = period / steps;
  const auto wave_costs = [&](std::size_t piece) {
    std::vector<double> costs(n);
    for (std::size_t s = 0; s < n; ++s) costs[s] = waves.cost(piece, width * static_cast<double>(s));
    return costs;
  };
  // As far as the turn may go from knot to knot: five standard deviations, or half of the period.
  const double stiffness = stiffer * knots.stiffness() * width * width;
  const int reach = knots.count() > 1 ? static_cast<int>(std::min(0.5 * steps, 1 + 5 / std::sqrt(stiffness))) : 0;
  std::vector<double> cost = wave_costs(0);
  std::vector<std::vector<int>> moved(1, std::vector<int>(n, 0));  // steps from the knot before
  for (std::size_t piece = 1; piece < waves.pieces(); ++piece) {
    std::vector<double> after = wave_costs(piece);
    std::vector<int>& ways = moved.emplace_back(n, 0);
    for (std::size_t s = 0; s < n; ++s) {
      double least = std::numeric_limits<double>::infinity();
      for (int way = -reach; way <= reach; ++way) {
        const double sum = cost[(s + static_cast<std::size_t>(steps - way)) % n] + stiffness * way * way;
        if (sum < least) least = sum, ways[s] = way;
      }
      after[s] += least;
    }
    cost = std::move(after);
  }
  std::vector<std::size_t> valleys;
  for (std::size_t s = 0; s < n; ++s) {
    if (cost[s] <= cost[(s + n - 1) % n] && cost[s] < cost[(s + 1) % n]) valleys.push_back(s);
  }
  if (valleys.empty()) valleys.push_back(0);
  std::ranges::sort(valleys, {}, [&](std::size_t s) { return cost[s]; });
  if (valleys.size() > looked_at) valleys.resize(looked_at);
  std::vector<Turn> turns;
  for (const std::size_t valley : valleys) {
    Turn turn{std::vector<double>(knots.count(), 0.0), 0};
    auto at = static_cast<int>(valley);
    turn.at.back() = width * at;
    for (std::size_t piece = waves.pieces(); knots.count() > 1 && piece-- > 0;) {
      at -= moved[piece][static_cast<std::size_t>((at % steps + steps) % steps)];
      turn.at[piece] = width * at;
    }
    turns.push_back(std::move(turn));
  }
  return turns;
}

/// Takes out of the other columns what the last one, the turn, does instead, and drops it.
TurnPrior project_off_turn(std::vector<Residuals>& out, const Knots& knots, const Turn& turn) {
  const std::span<const double> at = turn.at;
  TurnEquations equations(knots, at);
  Eigen::Index parameters = 0;
  std::vector<std::vector<Knots::Place>> places(out.size());
  for (std::size_t s = 0; s < out.size(); ++s) {
    if (!out[s].informed()) continue;
    parameters = out[s].sensitivity.cols() - 1;
    places[s] = knots.of(out[s]);
    equations.add(out[s], places[s]);
  }
  const bool many = at.size() > 1;
  const auto changes = static_cast<Eigen::Index>(at.size()) - 1;  // from knot to knot
  Eigen::MatrixXd changed = Eigen::MatrixXd::Zero(changes, parameters);
  for (Eigen::Index j = 0; equations.informed() && j < parameters; ++j) {
    std::vector<double> shared(at.size(), 0.0);
    for (std::size_t s = 0; s < out.size(); ++s) {
      if (!out[s].informed()) continue;
      const double* column = out[s].sensitivity.col(j).data();
      const double* of_turn = out[s].sensitivity.col(parameters).data();
      for (std::size_t i = 0; i < places[s].size(); ++i) {
        const auto [knot, share] = places[s][i];
        shared[knot] += (1 - share) * of_turn[i] * column[i];
        if (many) shared[knot + 1] += share * of_turn[i] * column[i];
      }
    }
    const std::vector<double> instead = equations.solved(std::move(shared));
    for (std::size_t s = 0; s < out.size(); ++s) {
      if (!out[s].informed()) continue;
      double* column = out[s].sensitivity.col(j).data();
      const double* of_turn = out[s].sensitivity.col(parameters).data();
      for (std::size_t i = 0; i < places[s].size(); ++i) {
        const auto [knot, share] = places[s][i];
        column[i] -= of_turn[i] * (many ? (1 - share) * instead[knot] + share * instead[knot + 1] : instead[knot]);
      }
    }
    for (Eigen::Index k = 0; k < changes; ++k) {
      changed(k, j) = instead[static_cast<std::size_t>(k) + 1] - instead[static_cast<std::size_t>(k)];
    }
  }
  for (Residuals& r : out) {
    if (r.informed()) r.sensitivity.conservativeResize(Eigen::NoChange, parameters);
  }
  if (!many) return {};
  Eigen::VectorXd change(changes);
  for (Eigen::Index k = 0; k < changes; ++k) {
    change[k] = at[static_cast<std::size_t>(k) + 1] - at[static_cast<std::size_t>(k)];
  }
  return {knots.stiffness() * gram(changed), knots.stiffness() * transposed_product(changed, change)};
}

/// A turn on its way to where the record fits best, a simulation at a time: Gauss and Newton, a step that does not help
/// halved.
class Follower {
 public:
  /// @param longest [rad] of a step
  Follower(const PreparedRun& record, const ModelStructure& structure, std::span<const double> values,
           const Knots& knots, Turn start, double longest)
      : record_(record),
        structure_(structure),
        values_(values),
        knots_(knots),
        longest_(longest),
        turn_(std::move(start)),
        step_(turn_.at.size(), 0.0) {}

  /// Simulates the next step, at first the start.
  void look() {
    if (done_) return;
    const Turn tried = stepped();
    const std::vector<Residuals> seen = with_turn(record_, structure_, values_, {}, knots_, tried);
    const double cost = sum_of_squares(seen) + tried.unlikely;
    if (cost > cost_) {
      for (double& s : step_) s *= 0.5;
      promised_ *= 0.5;
      return;
    }
    cost_ = cost;
    turn_ = tried;
    const TurnEquations equations = equations_of(seen, knots_, turn_.at);
    step_ = equations.informed() ? equations.step() : std::vector<double>(step_.size(), 0.0);
    double largest = 0;
    for (double& s : step_) {
      s = std::clamp(s, -longest_, longest_);
      largest = std::max(largest, std::abs(s));
    }
    promised_ = equations.gain(step_);
    constexpr double sure = 0.2;  // of the longest: what is linear holds, and the step needs no proof
    done_ = largest < sure * longest_;
  }
  void look(int times) {
    for (int k = 0; k < times; ++k) look();
  }

  double expected() const { return cost_ - promised_; }  ///< cost after the next step
  Turn turn() const { return done_ ? stepped() : turn_; }

 private:
  Turn stepped() const {
    Turn there = turn_;
    for (std::size_t i = 0; i < step_.size(); ++i) there.at[i] += step_[i];
    there.unlikely = unlikely(knots_, there.at);
    return there;
  }

  const PreparedRun& record_;
  const ModelStructure& structure_;
  std::span<const double> values_;
  const Knots& knots_;
  double longest_;
  Turn turn_;
  std::vector<double> step_;
  double cost_ = std::numeric_limits<double>::infinity(), promised_ = 0;
  bool done_ = false;
};

/// The one of some turns from which the record fits best in the end. All are looked at, two of them more closely.
Turn best_followed(const PreparedRun& record, const ModelStructure& structure, std::span<const double> values,
                   const Knots& knots, const std::vector<Turn>& from, double longest) {
  constexpr std::size_t closely = 2;
  constexpr int looks = 2, to_the_end = 8;
  std::vector<Follower> ways;
  for (const Turn& turn : from) ways.emplace_back(record, structure, values, knots, turn, longest).look();
  std::vector<std::size_t> order(ways.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t k) { return ways[k].expected(); });
  if (order.size() > closely) order.resize(closely);
  for (const std::size_t k : order) ways[k].look(looks);
  Follower& best = ways[*std::ranges::min_element(order, {}, [&](std::size_t k) { return ways[k].expected(); })];
  best.look(to_the_end);
  return best.turn();
}

/// The same of turns that do not change in the course of the record: nearly linear, so no step needs to be proved.
Turn stepped_to(const PreparedRun& record, const ModelStructure& structure, std::span<const double> values,
                const Knots& knots, Turn turn, int steps, double longest) {
  for (int k = 0; k < steps; ++k) {
    const TurnEquations equations = equations_of(with_turn(record, structure, values, {}, knots, turn), knots, turn.at);
    if (!equations.informed()) break;
    turn.at.front() += std::clamp(equations.step().front(), -longest, longest);
  }
  return turn;
}

}  // namespace

Turn best_turn(const PreparedRun& record, const ModelStructure& structure, std::span<const double> values,
               const Turn* near) {
  if (near != nullptr && near->at.empty()) near = nullptr;
  const std::vector<PeriodicPart> parts = periodic_parts(structure, values);
  if (parts.empty()) return {};
  const auto [slowest, fastest] = std::ranges::minmax(parts, {}, &PeriodicPart::order);
  const Knots knots(record, near != nullptr ? near->at.size() : Knots::wanted(record, fastest.order));
  const double period = 2 * std::numbers::pi / slowest.order;
  const int steps = 8 * static_cast<int>(std::lround(std::max(1.0, fastest.order / slowest.order)));
  const double longest = period / steps;
  const bool many = knots.count() > 1;
  if (near != nullptr && many) {
    constexpr int looks = 2;
    Follower follower(record, structure, values, knots, *near, longest);
    follower.look(looks);
    return follower.turn();
  }
  if (near != nullptr) return stepped_to(record, structure, values, knots, *near, 1, longest);
  // There is a valley for each period of the fastest; what is linear tells the lowest of them, near enough. Where the
  // shaft stops it tells little: there a turn that hardly changes may be the better one.
  constexpr double hardly = 100;
  const WavesOfTurn waves(record, structure, values, parts, knots);
  std::vector<Turn> turns = likely_turns(waves, knots, period, steps, 1);
  if (many) {
    for (Turn& stiffer : likely_turns(waves, knots, period, steps, hardly)) {
      if (std::ranges::find(turns, stiffer.at, &Turn::at) == turns.end()) turns.push_back(std::move(stiffer));
    }
    return best_followed(record, structure, values, knots, turns, longest);
  }
  std::pair<double, Turn> best{std::numeric_limits<double>::infinity(), turns.front()};
  for (Turn& turn : turns) {
    const double cost = sum_of_squares(turned_residuals(record, structure, values, {}, knots, turn));
    if (cost < best.first) best = {cost, std::move(turn)};
  }
  return stepped_to(record, structure, values, knots, std::move(best.second), 2, longest);
}

ResidualsAtTurn residuals_at_turn(const PreparedRun& record, const ModelStructure& structure,
                                  std::span<const double> values, std::span<const std::vector<std::size_t>> moved,
                                  const Turn& turn) {
  if (turn.at.empty()) return {simulated_residuals(record, structure, values, moved), {}};
  const Knots knots(record, turn.at.size());
  if (moved.empty()) return {turned_residuals(record, structure, values, {}, knots, turn), {}};
  std::vector<Residuals> out = with_turn(record, structure, values, moved, knots, turn);
  TurnPrior prior = project_off_turn(out, knots, turn);
  return {std::move(out), std::move(prior)};
}

Turned residuals_at_best_turns(std::span<const PreparedRun> records, const Model& model, std::span<const double> values,
                               std::span<const std::vector<std::size_t>> moved, std::span<const Turn> near) {
  Turned out{Turns(records.size()), {}};
  std::vector<std::vector<Residuals>> each(records.size());
  const auto one = [&](std::size_t i) {
    const ModelStructure structure = records[i].structure(model);
    out.turns[i] = best_turn(records[i], structure, values, near.empty() ? nullptr : &near[i]);
    each[i] = residuals_at_turn(records[i], structure, values, moved, out.turns[i]).residuals;
    for (Residuals& r : each[i]) r.record = i;
  };
  parallel_for(records.size(), one, [&](std::size_t i) { return records[i].length(); });
  for (auto& of_one : each) std::ranges::move(of_one, std::back_inserter(out.residuals));
  return out;
}

}  // namespace emtb
