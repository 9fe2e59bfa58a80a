#include "analysis/live/misfit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "analysis/live/missing_effects.h"
#include "analysis/numerics/linear_algebra.h"

namespace emtb {
namespace {

// By hand, on the two simulated benches (docs/decisions/live-estimates.md).
constexpr double shortest_half = 0.5;  ///< [s] the resolution in time of a change
constexpr double half_life = 180;      ///< [s] after which what was seen counts half
constexpr std::size_t most_halves = ChangeWatch::looked_through + ChangeWatch::follow + 8;
constexpr std::array<std::size_t, 10> changed_for{1, 2, 3, 4, 5, 6, 8, 11, 15, 20};  ///< half-seconds
constexpr double transient_share = 0.005;  ///< of what the inertia does, that a simulation may be off in a transient
constexpr double even = 10;           ///< noise floors (RMS) of what the inertia does, below which a motor runs evenly
constexpr double gross_share = 0.05;  ///< of a parameter's value, beyond which what is linear about it is worth nothing
constexpr double standstill = 0.04;   ///< of the highest speed, below which nothing counts

/// Of what is left of the history, the first tick is that of a run.
bool from_its_start(const std::vector<LiveChapter>& history) {
  const auto first = std::ranges::find_if(history, [](const LiveChapter& c) { return !c.ticks.empty(); });
  return first != history.end() && first->ticks.front().kind == LiveTick::Kind::run_start;
}

}  // namespace

LiveMisfit::LiveMisfit(const Model& model, const LivePlan& plan)
    : unknowns_(model, plan),
      ticks_of_half_(std::max<std::size_t>(static_cast<std::size_t>(shortest_half / plan.period), plan.second / 2)),
      pass_(unknowns_.plan(), *this),
      at_rest_(plan.outputs.size()),
      zero_(LiveEquations::zero(unknowns_.size())),
      prior_(unknowns_.prior()),
      known_(prior_),
      rows_(plan.outputs.size(), unknowns_.size(), most_halves),
      scatter_(unknowns_.size()),
      expected_(zero_.g),
      by_speed_(Signal::omega, plan.outputs.size()),
      by_current_(Signal::i_a, plan.outputs.size()) {
  pass_.begin(unknowns_.point());
}

void LiveMisfit::set_noise(const std::vector<NoiseColour>& colours, double of_gauge) {
  latest_colours_ = colours;
  // A motor averages it over its time constant, of two blocks.
  const auto block = static_cast<double>(unknowns_.plan().block);
  load_noise_ = unknowns_.gauge() ? of_gauge / std::sqrt(2.0 * block) : 0;
}

/// All that was seen, but not the values.
void LiveMisfit::forget() {
  rows_.clear();
  ticks_ = 0;
  known_ = prior_;
  expected_ = zero_.g;
  scatter_ = ScoreScatter(unknowns_.size());
  watch_.forget();
}

bool LiveMisfit::advance(const std::vector<LiveChapter>& history, std::size_t end) {
  if (follow_anew_ && from_its_start(history)) {
    forget();
    pass_.begin(unknowns_.point());
    t_before_ = pass_.t();
  }
  follow_anew_ = false;
  if (!pass_.advance(history, end)) return false;
  if (pass_.t() < t_before_) ++run_;
  t_before_ = pass_.t();
  if (ticks_++ == 0) {
    rows_.open().begin = pass_.t();
    rows_.open().run = run_;
  }
  if (ticks_ >= ticks_of_half_) close_half_second();
  return true;
}

/// How much a row counts. A step of the reference shows the inertia a hundred times better than the simulation can be
/// trusted; and the noise of a measured load moves the simulated motor, more than the instruments' own noise does.
double LiveMisfit::trust(std::size_t output, const Eigen::VectorXd& s) const {
  if (colours_.empty()) return 1.0;
  const double sigma = colours_[output].sigma;
  const std::size_t inertia = unknowns_.inertia();
  const double off = transient_share * s[as_index(inertia)] * unknowns_.value(inertia) / sigma;
  const double by_load = unknowns_.drag() ? load_noise_ * s[as_index(*unknowns_.drag())] / sigma : 0;
  return 1 / std::sqrt(1 + off * off + by_load * by_load);
}

/// A motor stands until the model has it move in a run; later the two may not stand at the same time.
void LiveMisfit::see_at_rest(const LiveRow& row) {
  constexpr double clear = 5;  // of the deviations of a block
  if (latest_colours_.empty()) return;
  const auto& outputs = unknowns_.plan().outputs;
  const auto speed = std::ranges::find(outputs, Signal::omega, &LivePlan::Output::signal);
  if (speed == outputs.end()) return;
  const double sigma = latest_colours_[static_cast<std::size_t>(speed - outputs.begin())].sigma;
  if (moved_in_ != run_ && std::abs(row.omega) > clear * sigma) moved_in_ = run_;
  if (moved_in_ != run_) at_rest_.see(row.output, row.r);
}

void LiveMisfit::take(const LiveRow& row) {
  HalfSecond& open = rows_.open();
  see_at_rest(row);
  reach_.see(row.omega, row.i_a);
  // About to stop or to break loose, friction is another than at speed, and small errors decide which.
  if (std::abs(row.omega) < standstill * reach_.omega) return;
  const double now = trust(row.output, row.s);
  scaled_ = now * row.s;
  open.sums[row.output].add(scaled_, now * row.r);
  if (row.follows) {
    const double then = trust(row.output, row.s_before);
    scaled_before_ = then * row.s_before;
    open.sums[row.output].add_pair(scaled_before_, then * row.r_before, scaled_, now * row.r);
  }
  if (colours_.empty()) return;
  const double left = (row.r - row.s.dot(expected_)) / colours_[row.output].sigma;
  open.weight += left * left;
  open.omega += left * left * row.omega;
  open.i_a += left * left * row.i_a;
  if (!watch_.half_learnt()) return;
  by_speed_.add(row.omega, row.output, left);
  by_current_.add(row.i_a, row.output, left);
}

void LiveMisfit::close_half_second() {
  ticks_ = 0;
  HalfSecond& half = rows_.open();
  if (half.blocks() == 0) return;  // a motor that stands tells nothing; its time does not count
  if (runs_evenly(half)) {
    for (LagSums& sums : half.sums) sums.level();
  }
  rows_.close();
  watch_.see();
  if (!watch_.learnt() || colours_.empty()) colours_ = latest_colours_;
  if (!colours_.empty()) {
    if (watch_.following()) {
      follow_change();
    } else {
      look_for_change();
    }
  }
  while (!watch_.following() && rows_.closed() > ChangeWatch::looked_through) retire_oldest();
  if (watch_.becomes_known()) follow_anew_ = watch_.first_motor();
}

bool LiveMisfit::runs_evenly(const HalfSecond& half) const {
  const std::size_t inertia = unknowns_.inertia();
  for (std::size_t o = 0; o < half.sums.size() && !colours_.empty(); ++o) {
    const double rms = std::sqrt(half.sums[o].mean_square(as_index(inertia))) * unknowns_.value(inertia);
    if (rms > even * colours_[o].sigma) return false;
  }
  return !colours_.empty();
}

void LiveMisfit::retire_oldest() {
  const double kept = std::exp2(-static_cast<double>(ticks_of_half_) * unknowns_.plan().period / half_life);
  if (!colours_.empty()) scatter_.add(equations(rows_.oldest().sums), expected_, kept);
  known_.h = prior_.h + kept * (known_.h - prior_.h);
  known_.g = prior_.g + kept * (known_.g - prior_.g);
  rows_.retire_oldest(kept);
}

LiveEquations LiveMisfit::equations(std::span<const LagSums> outputs) const {
  LiveEquations e = zero_;
  e.add(outputs, colours_);
  return e;
}

Timeline LiveMisfit::timeline() const {
  Timeline time{equations(rows_.older()), {}};
  time.known += known_;
  for (std::size_t j = 0; j < unknowns_.parameters().size(); ++j) {
    if (unknowns_.parameters()[j].in_model()) continue;
    const double size = unknowns_.believed_size(j, reach_);
    if (size > 0) time.known.h(as_index(j), as_index(j)) += 1 / (size * size);
  }
  for (const HalfSecond& half : rows_.last(rows_.closed())) time.half_seconds.push_back(equations(half.sums));
  return time;
}

ChangeTest LiveMisfit::test() const {
  return ChangeTest({.unknowns = unknowns_,
                     .rows = rows_,
                     .colours = colours_,
                     .reach = reach_,
                     .inflation = scatter_.inflation(),
                     .loaded = loaded_});
}

/// Where and when it changed, with what, and how much.
LiveChange LiveMisfit::change_of(const ChangeScore& found) const {
  const std::span<const HalfSecond> halves = rows_.last(found.half_seconds);
  const HalfSecond& first = halves.front();
  LiveChange change{.since = first.run == run_ ? first.begin : 0, .noticed = pass_.t(), .suspects = found.suspects};
  double weight = 0;
  for (const HalfSecond& half : halves) {
    weight += half.weight;
    change.omega += half.omega;
    change.i_a += half.i_a;
  }
  if (weight > 0) {
    change.omega /= weight;
    change.i_a /= weight;
  }
  return change;
}

/// The gauge shows that there are loads: remembered.
void LiveMisfit::notice_load(const Timeline& time) {
  if (!unknowns_.gauge() || loaded_) return;
  const LiveEquations before = time.before(std::min<std::size_t>(rows_.closed(), ChangeWatch::looked_through / 2));
  const Eigen::MatrixXd covariance = scaled_inverse(before.h);
  loaded_ = test().shows_load(covariance * before.g, covariance);
}

/// Of the moments at which it may have been, the one with which a single change explains most.
/// @param highest the highest score of all
ChangeScore LiveMisfit::most_likely_change(const Timeline& time, double& highest) const {
  const ChangeTest test = this->test();
  ChangeScore best;
  for (const std::size_t last : changed_for) {
    if (!watch_.may_look(last) || last > rows_.closed()) break;
    ChangeScore found = test.of(time, last);
    highest = std::max(highest, found.score);
    const bool better = found.score >= change_at::alarm
                            ? best.score < change_at::alarm || (1 - tied_within) * found.drop > best.drop
                            : best.score < change_at::alarm && found.score > best.score;
    if (better) best = std::move(found);
  }
  return best;
}

void LiveMisfit::look_for_change() {
  const Timeline time = timeline();
  const LiveEquations all = time.before(0);
  // Where the model itself is, without what it lacks.
  const std::vector<Eigen::Index>& of_model = unknowns_.of_model();
  const Eigen::MatrixXd information = all.h(of_model, of_model);
  const Eigen::MatrixXd covariance = scaled_inverse(information);
  const Eigen::VectorXd x = covariance * all.g(of_model);
  expected_.setZero();
  if (!x.allFinite()) return forget();
  expected_(of_model) = x;
  if (watch_.half_learnt()) {
    points_to_ =
        missing_effects(unknowns_, rows_, colours_, all, expected_, covariance, scatter_.inflation(), at_rest_);
  }
  if (!watch_.learnt()) return;
  notice_load(time);
  double highest = 0;
  const ChangeScore best = most_likely_change(time, highest);
  const ChangeWatch::Then then = watch_.look(highest, best.score);
  if (!watch_.doubtful()) colours_ = latest_colours_;
  switch (then) {
    case ChangeWatch::Then::wait:
      return;
    case ChangeWatch::Then::begin_again:
      return forget();
    case ChangeWatch::Then::tell:
      return watch_.tell(change_of(best), best.half_seconds);
    case ChangeWatch::Then::learn:
      if (x.dot(information * x) > static_cast<double>(of_model.size())) move_point(expected_);
  }
}

void LiveMisfit::follow_change() {
  const ChangeScore found = test().of(timeline(), watch_.follow_on());
  watch_.correct(found.score, change_of(found));
  if (watch_.followed()) settle_into_change();
}

/// The motor counts as what it has become, as far as the change explains it; the rest is learnt anew.
void LiveMisfit::settle_into_change() {
  const Timeline time = timeline();
  const ChangeTest test = this->test();
  const LiveEquations earlier = time.before(watch_.since_change());
  const ChangeScore found = test.of(time, watch_.since_change());
  const Eigen::MatrixXd claimed = scaled_inverse(earlier.h);
  Eigen::VectorXd at = claimed * earlier.g;
  Eigen::MatrixXd covariance = test.inflated(claimed);
  for (std::size_t k = 0; k < found.suspects.size(); ++k) {
    const Eigen::Index j = as_index(found.parameters[k]);
    const double size = found.suspects[k].change;
    covariance(j, j) += 4 * size * size;
    if (k == 0) at[j] += size;
  }
  const bool explained = !found.suspects.empty() && at.allFinite() && covariance.allFinite();
  const ScoreScatter scatter = scatter_;
  forget();
  watch_.learn_anew();
  if (!explained) return;
  scatter_ = scatter;
  known_.h = scaled_inverse(covariance);
  known_.g = known_.h * at;
  move_point(at);
}

void LiveMisfit::learn(std::span<const double> values) {
  if (!watch_.takes_values()) return;
  Eigen::VectorXd d = zero_.g;
  bool far = false;
  for (std::size_t j = 0; unknowns_.moves(j); ++j) {
    const WatchedParameter& p = unknowns_.parameters()[j];
    if (!p.in_model()) continue;
    const double from = unknowns_.value(j), to = values[*p.at];
    d[as_index(j)] = to - from;
    const bool decisive = *p.at < ModelStructure::base_count && *p.at != base::B;
    far = far || (decisive && std::abs(to - from) > gross_share * std::abs(from));
  }
  move_point(d);
  if (far) {
    forget();
    watch_.restart_learning();
  }
}

/// The unknowns count from another point. @param d of which only the model's own parameters move
void LiveMisfit::move_point(const Eigen::VectorXd& d) {
  if (!d.allFinite()) return;
  const Eigen::VectorXd moved = unknowns_.move_point(d);
  pass_.follow(unknowns_.point());
  rows_.move_point(moved);
  prior_.g -= prior_.h * moved;
  known_.g -= known_.h * moved;
  expected_ -= moved;
}

LiveMisfitReport LiveMisfit::report() const {
  LiveMisfitReport r{.watching = watch_.watching(),
                     .score = watch_.score(),
                     .changes = watch_.changes(),
                     .points_to = points_to_,
                     .where = by_speed_.bins(unknowns_.plan())};
  for (LiveBin& bin : by_current_.bins(unknowns_.plan())) r.where.push_back(std::move(bin));
  return r;
}

}  // namespace emtb
