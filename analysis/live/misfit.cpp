#include "analysis/live/misfit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "analysis/numerics/linear_algebra.h"
#include "model/catalogue.h"

namespace emtb {
namespace {

constexpr std::size_t misfit_lanes = 2 * derivatives_per_pass;
constexpr double shortest_slot = 0.5;     ///< [s] the resolution in time of a change
constexpr double old_memory = 180;        ///< [s] after which what was seen counts half
constexpr std::size_t recent_slots = 20;  ///< in which a change is looked for
constexpr std::size_t follow_slots = 30;  ///< for which the size of a change is followed
constexpr std::size_t learn_slots = 20;   ///< before which nothing is a change
constexpr std::size_t own_slots = 60;     ///< after which the estimator's values are no longer waited for
constexpr std::size_t ring_slots = recent_slots + follow_slots + 8;
constexpr std::array<std::size_t, 10> splits{1, 2, 3, 4, 5, 6, 8, 11, 15, 20};
constexpr double alarm_at = 5;        ///< standard errors
constexpr int alarm_looks = 5;        ///< for which it stands until it is told
constexpr double doubtful_at = 4;     ///< standard errors, above which nothing is learnt
constexpr double tied_within = 0.02;  ///< of what the best explains: those explain it as well
constexpr std::size_t most_tied = 3;
constexpr double drift_share = 3e-3;       ///< of a parameter's value, that is no change
constexpr double flux_drift = 1e-3;        ///< the same of K_b and K_m
constexpr double drift_of_null = 0.02;     ///< the same of what the model lacks, of its believed size
constexpr double digit_share = 0.3;        ///< of an instrument's resolution by which its mean may be off
constexpr double transient_share = 0.005;  ///< of what the inertia does, that a simulation may be off in a transient
constexpr double even = 10;           ///< noise floors (RMS) of what the inertia does, below which a motor runs evenly
constexpr double gross_share = 0.05;  ///< of a parameter's value, beyond which what is linear about it is worth nothing
constexpr double material_share = 0.1;  ///< of what is left, that an effect has to explain
constexpr double most_varied = 3;       ///< times the noise of a gauge, beyond which loads come and go
constexpr double standstill = 0.04;     ///< of the highest speed, below which nothing counts
constexpr double believed = 0.02;       ///< of what the motor does, as the size of what the model lacks
constexpr std::size_t most_told = 8;    ///< changes that are kept
constexpr double grid_memory = 300;     ///< blocks in one bin of the grid

}  // namespace

struct LiveMisfit::Setup {
  LivePlan plan;
  std::vector<Direction> directions;
  std::vector<double> values;
};

LiveMisfit::Setup LiveMisfit::set_up(const Model& model, const LivePlan& given) {
  Setup setup;
  setup.plan = given;
  LivePlan& plan = setup.plan;
  const auto measures = [&](Signal signal) {
    return std::ranges::find(plan.outputs, signal, &LivePlan::Output::signal) != plan.outputs.end();
  };

  Model whole = model;
  std::size_t moving = given.moved.size();
  for (const Parameter& p : model.base) moving += p.fixed && !model.tie.contains(p.symbol) ? 1 : 0;
  std::size_t room = (std::max<std::size_t>(moving, 1) + misfit_lanes - 1) / misfit_lanes * misfit_lanes - moving;
  const std::vector<std::size_t> watched = watched_effects();
  // What goes nowhere but into one reading: the errors of instruments, and a load that is measured.
  const auto shown_by = [&](std::size_t effect) {
    const EffectInfo& about = effect_catalogue()[effect];
    return about.stage == Stage::load && given.structure.measured_load ? Signal::torque : about.reads;
  };
  for (const std::size_t effect : watched) {
    if (room == 0 || whole.includes(effect) || shown_by(effect)) continue;
    whole.include(effect);
    --room;
  }
  const ModelStructure as_given = plan.structure;
  plan.structure = whole.structure();
  plan.structure.measured_voltage = as_given.measured_voltage;
  plan.structure.measured_load = as_given.measured_load;

  const FreeParameters free(whole);
  const std::vector<std::string> names = whole.names(), model_names = model.names();
  setup.values = whole.values();
  std::map<std::string, std::size_t> amplitudes;  // of the watched effects
  for (const std::size_t effect : watched) amplitudes.emplace(full_name(effect_catalogue()[effect]), effect);
  const auto in_model = [&](const std::string& name) -> std::optional<std::size_t> {
    const auto at = std::ranges::find(model_names, name);
    if (at == model_names.end()) return {};
    return static_cast<std::size_t>(at - model_names.begin());
  };
  plan.moved.clear();
  const auto moves = moved_by(free);
  const auto add = [&](std::size_t place, std::vector<std::size_t> moved) {
    const Parameter& p = whole.at(place);
    Direction d{.name = names[place], .unit = p.unit, .low = p.min, .high = p.max, .at = {}, .prior = {}};
    d.at = in_model(d.name);
    d.in_model = d.at.has_value();
    d.prior = p.prior;
    if (p.fixed) d.fixed_to = drift_share * std::abs(p.value);
    if (!d.in_model) {
      d.effect = amplitudes.at(d.name);
      d.may_change = effect_catalogue()[d.effect].watch->varies;
    }
    setup.directions.push_back(std::move(d));
    plan.moved.push_back(std::move(moved));
  };
  // What the model moves and what it fixes first, then what it lacks.
  for (const bool of_model : {true, false}) {
    for (std::size_t k = 0; k < free.size(); ++k) {
      const std::size_t place = free.places()[k];
      if (in_model(names[place]).has_value() != of_model) continue;
      if (!of_model && !amplitudes.contains(names[place])) continue;
      add(place, moves[k]);
    }
    if (!of_model) continue;
    for (std::size_t place = 0; place < ModelStructure::base_count; ++place) {
      if (!whole.base[place].fixed || whole.tie.contains(whole.base[place].symbol)) continue;
      std::vector<std::size_t> moved{place};
      for (const auto& [follower, leader] : whole.tie) {
        if (leader == names[place]) {
          moved.push_back(static_cast<std::size_t>(std::ranges::find(names, follower) - names.begin()));
        }
      }
      add(place, std::move(moved));
    }
  }
  for (const std::size_t effect : watched) {
    const std::optional<Signal> signal = shown_by(effect);
    if (!signal || !measures(*signal) || whole.includes(effect)) continue;
    const EffectInfo& about = effect_catalogue()[effect];
    const EffectParameter& p = about.parameter_list[0];
    setup.directions.push_back({.name = full_name(about),
                                .unit = std::string(p.unit),
                                .low = p.min,
                                .high = p.max,
                                .effect = effect,
                                .at = {},
                                .prior = {}});
    plan.direct.push_back(*signal);
  }

  plan.offsets = 0;
  for (auto& output : plan.outputs) {
    if (output.slow) output.offset = plan.moved.size() + plan.direct.size() + plan.offsets++;
  }
  plan.seconds = 0;  // no sums of its own
  return setup;
}

LiveMisfit::LiveMisfit(const Model& model, const LivePlan& plan) : LiveMisfit(set_up(model, plan)) {}

LiveMisfit::LiveMisfit(Setup setup)
    : plan_(std::move(setup.plan)),
      directions_(std::move(setup.directions)),
      slot_ticks_(std::max<std::size_t>(static_cast<std::size_t>(shortest_slot / plan_.period), plan_.second / 2)),
      digits_([&] {
        Eigen::VectorXd digits = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(plan_.unknowns()));
        for (const auto& output : plan_.outputs) {
          if (output.slow) digits[static_cast<Eigen::Index>(output.offset)] = std::max(output.lsb, 1e-9);
        }
        return digits;
      }()),
      of_model_([&] {
        std::vector<Eigen::Index> unknowns;
        for (Eigen::Index i = 0; i < digits_.size(); ++i) {
          if (digits_[i] > 0 || directions_[static_cast<std::size_t>(i)].in_model) unknowns.push_back(i);
        }
        return unknowns;
      }()),
      point_(std::move(setup.values)),
      pass_(plan_, *this) {
  const auto n = static_cast<Eigen::Index>(plan_.unknowns());
  base_prior_ = Eigen::MatrixXd::Zero(n, n);
  base_prior_g_ = Eigen::VectorXd::Zero(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    double& information = base_prior_(i, i);
    if (digits_[i] > 0) {
      information = 12 / (digits_[i] * digits_[i]);
      continue;
    }
    const Direction& d = directions_[static_cast<std::size_t>(i)];
    const double range = d.high - d.low;
    information = 12 / (range * range);
    if (d.fixed_to > 0) information = 1 / (d.fixed_to * d.fixed_to);
    if (d.prior) {
      information = 1 / (d.prior->std * d.prior->std);
      base_prior_g_[i] = information * (d.prior->value - value_of_direction(static_cast<std::size_t>(i)));
    }
  }
  const std::vector<LagSums> none(plan_.outputs.size(), LagSums(n));
  old_ = none;
  ring_.assign(ring_slots, Slot{.sums = none});
  const auto dry_friction = std::ranges::find(effect_catalogue(), true, &EffectInfo::dry_friction);
  for (std::size_t j = 0; j < directions_.size(); ++j) {
    if (directions_[j].name == "K_b") flux_ = j;
    if (directions_[j].name == "J") inertia_ = j;
    if (directions_[j].name == full_name(*dry_friction)) drag_ = j;
    if (j >= plan_.moved.size() && plan_.direct[j - plan_.moved.size()] == Signal::torque) gauge_ = j;
  }
  for (const auto& output : plan_.outputs) {
    if (output.signal == Signal::torque) gauge_digit_ = output.lsb;
  }
  for (Grid* grid : {&by_speed_, &by_current_}) {
    for (auto& cell : grid->cells) cell.resize(plan_.outputs.size());
  }
  clear();
  pass_.begin(point_);
}

double LiveMisfit::value_of_direction(std::size_t j) const {
  return j < plan_.moved.size() ? point_[plan_.moved[j].front()] : 0;  // what is direct has its null there
}

void LiveMisfit::clear() {
  for (LagSums& sums : old_) sums.clear();
  for (Slot& slot : ring_) {
    for (LagSums& sums : slot.sums) sums.clear();
    slot.weight = slot.omega = slot.i_a = 0;
  }
  filled_ = slots_seen_ = ticks_ = changed_slots_ = 0;
  base_ = base_prior_;
  base_g_ = base_prior_g_;
  expects_ = scatter_ = expected_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(plan_.unknowns()));
  score_ = 0;
  standing_ = 0;
}

/// Of what is left of the history, the first tick is that of a run.
bool LiveMisfit::from_its_start(const std::vector<LiveChapter>& history) {
  const auto first = std::ranges::find_if(history, [](const LiveChapter& c) { return !c.ticks.empty(); });
  return first != history.end() && first->ticks.front().kind == LiveTick::Kind::run_start;
}

bool LiveMisfit::advance(const std::vector<LiveChapter>& history, std::size_t end) {
  if (follow_anew_ && from_its_start(history)) {
    clear();
    pass_.begin(std::vector<double>(point_));
    t_before_ = pass_.t();
  }
  follow_anew_ = false;
  if (!pass_.advance(history, end)) return false;
  if (pass_.t() < t_before_) ++run_;
  t_before_ = pass_.t();
  Slot& open = ring_[filled_];
  if (ticks_++ == 0) {
    open.begin = pass_.t();
    open.run = run_;
  }
  if (ticks_ >= slot_ticks_) close_slot();
  return true;
}

void LiveMisfit::take(const LiveRow& row) {
  Slot& open = ring_[filled_];
  reach_omega_ = std::max(reach_omega_, std::abs(row.omega));
  reach_i_a_ = std::max(reach_i_a_, std::abs(row.i_a));
  // About to stop or to break loose, friction is another than at speed, and small errors decide which.
  if (std::abs(row.omega) < standstill * reach_omega_) return;
  // A step of the reference shows the inertia a hundred times better than the simulation can be trusted; and the noise
  // of a measured load moves the simulated motor, more than the instruments' own noise does.
  const auto trust = [&](const Eigen::VectorXd& s) {
    if (colour_.empty()) return 1.0;
    const double sigma = colour_[row.output].sigma;
    const double off = transient_share * s[static_cast<Eigen::Index>(inertia_)] * value_of_direction(inertia_) / sigma;
    const double by_load = drag_ ? load_noise_ * s[static_cast<Eigen::Index>(*drag_)] / sigma : 0;
    return 1 / std::sqrt(1 + off * off + by_load * by_load);
  };
  const double now = trust(row.s);
  scaled_ = now * row.s;
  open.sums[row.output].add(scaled_, now * row.r);
  if (row.follows) {
    const double then = trust(row.s_before);
    scaled_before_ = then * row.s_before;
    open.sums[row.output].add_pair(scaled_before_, then * row.r_before, scaled_, now * row.r);
  }
  if (colour_.empty()) return;
  const double left = (row.r - row.s.dot(expects_)) / colour_[row.output].sigma;
  open.weight += left * left;
  open.omega += left * left * row.omega;
  open.i_a += left * left * row.i_a;
  if (slots_seen_ < learn_slots / 2) return;
  by_speed_.add(row.omega, row.output, left);
  by_current_.add(row.i_a, row.output, left);
}

void LiveMisfit::Grid::add(double x, std::size_t output, double normalised) {
  if (!std::isfinite(x) || !std::isfinite(normalised)) return;
  if (reach == 0) reach = 1e-3;
  while (std::abs(x) > reach) {  // two become one, on either side of zero
    reach *= 2;
    auto merged = cells;
    constexpr std::size_t half = bins / 2;
    for (auto& cell : merged) std::ranges::fill(cell, Cell{});
    for (std::size_t b = 0; b < bins; ++b) {
      const std::size_t to = half + b / 2 - half / 2;
      for (std::size_t o = 0; o < cells[b].size(); ++o) {
        merged[to][o].squares += cells[b][o].squares;
        merged[to][o].weight += cells[b][o].weight;
      }
    }
    cells = std::move(merged);
  }
  const double place = (x / reach + 1) * bins / 2;
  Cell& cell = cells[std::min(bins - 1, static_cast<std::size_t>(std::max(0.0, place)))][output];
  const double kept = 1 - 1 / grid_memory;
  cell.squares = kept * cell.squares + normalised * normalised;
  cell.weight = kept * cell.weight + 1;
}

void LiveMisfit::close_slot() {
  ticks_ = 0;
  Slot& slot = ring_[filled_];
  double blocks = 0;
  for (const LagSums& sums : slot.sums) blocks += sums.blocks();
  if (blocks == 0) return;  // a motor that stands tells nothing; its time does not count
  if (runs_evenly(slot)) {
    for (LagSums& sums : slot.sums) sums.level();
  }
  ++filled_;
  ++slots_seen_;
  if (slots_seen_ < learn_slots || colour_.empty()) colour_ = heard_;
  if (!colour_.empty()) {
    if (changed_slots_ > 0) {
      follow_change();
    } else {
      evaluate();
    }
  }
  while (changed_slots_ == 0 && filled_ > recent_slots) retire_oldest();
  ++taught_;
  const bool first = changes_.empty();  // then all that there is may be followed once more; else what came since
  if (!own_ && (first ? taught_ : slots_seen_) >= own_slots && score_ < doubtful_at) {
    own_ = true;
    follow_anew_ = first;
  }
}

bool LiveMisfit::runs_evenly(const Slot& slot) const {
  const double J = value_of_direction(inertia_);
  for (std::size_t o = 0; o < slot.sums.size() && !colour_.empty(); ++o) {
    if (std::sqrt(slot.sums[o].mean_square(static_cast<Eigen::Index>(inertia_))) * J > even * colour_[o].sigma)
      return false;
  }
  return !colour_.empty();
}

void LiveMisfit::retire_oldest() {
  const double kept = std::exp2(-static_cast<double>(slot_ticks_) * plan_.period / old_memory);
  Slot& oldest = ring_.front();
  if (!colour_.empty()) {
    const Equations e = equations(oldest.sums);
    scatter_ *= kept;
    expected_ *= kept;
    scatter_ += (e.g - e.h * expects_).cwiseAbs2();
    expected_ += e.h.diagonal();
  }
  base_ = base_prior_ + kept * (base_ - base_prior_);
  base_g_ = base_prior_g_ + kept * (base_g_ - base_prior_g_);
  for (std::size_t o = 0; o < old_.size(); ++o) {
    old_[o].fade(kept);
    old_[o].add(oldest.sums[o]);
    oldest.sums[o].clear();
  }
  oldest.weight = oldest.omega = oldest.i_a = 0;
  std::ranges::rotate(ring_, ring_.begin() + 1);
  --filled_;
}

LiveMisfit::Equations LiveMisfit::equations(const std::vector<LagSums>& sums) const {
  Equations e{Eigen::MatrixXd::Zero(base_.rows(), base_.cols()), Eigen::VectorXd::Zero(base_.rows())};
  for (std::size_t o = 0; o < sums.size(); ++o) {
    if (sums[o].blocks() > 0) sums[o].weigh_into(e.h, e.g, colour_[o]);
  }
  return e;
}

/// What is believed of effects that the model lacks: that they are small, by what the motor has done so far.
double LiveMisfit::belief(const Direction& d) const {
  const Ranges seen{.voltage = reach_omega_ * value_of_direction(flux_),
                    .current = reach_i_a_,
                    .torque = reach_i_a_ * value_of_direction(flux_),
                    .speed = reach_omega_};
  return size_at(d.effect, believed, seen);
}

/// By how much an unknown may differ from one time to another without being worth a word.
double LiveMisfit::slack_of(std::size_t j) const {
  const Direction& d = directions_[j];
  if (d.in_model) return (d.name.starts_with("K") ? flux_drift : drift_share) * std::abs(value_of_direction(j));
  double digit = 0;
  if (j >= plan_.moved.size()) {
    const Signal signal = plan_.direct[j - plan_.moved.size()];
    digit = std::ranges::find(plan_.outputs, signal, &LivePlan::Output::signal)->lsb;
  }
  return std::max(digit_share * digit, drift_of_null * belief(d));
}

LiveMisfit::Timeline LiveMisfit::timeline() const {
  Timeline t{equations(old_), {}};
  t.known += {base_, base_g_};
  for (std::size_t j = 0; j < directions_.size(); ++j) {
    if (directions_[j].in_model) continue;
    const double size = belief(directions_[j]);
    if (size > 0) t.known.h(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(j)) += 1 / (size * size);
  }
  for (std::size_t k = 0; k < filled_; ++k) t.slots.push_back(equations(ring_[k].sums));
  return t;
}

LiveMisfit::Equations LiveMisfit::Timeline::before(std::size_t last) const {
  Equations e = known;
  for (std::size_t k = 0; k + last < slots.size(); ++k) e += slots[k];
  return e;
}

LiveMisfit::Equations LiveMisfit::Timeline::recent(std::size_t last) const {
  Equations e{Eigen::MatrixXd::Zero(known.h.rows(), known.h.cols()), Eigen::VectorXd::Zero(known.g.size())};
  for (std::size_t k = slots.size() - std::min(last, slots.size()); k < slots.size(); ++k) e += slots[k];
  return e;
}

/// By what the scores of the half-seconds scattered more than their information says: √ of that, by unknown.
Eigen::VectorXd LiveMisfit::inflation() const {
  Eigen::VectorXd by(base_.rows());
  for (Eigen::Index i = 0; i < by.size(); ++i) {
    by[i] = expected_[i] > 0 ? std::sqrt(std::max(1.0, scatter_[i] / expected_[i])) : 1;
  }
  return by;
}

/// Does the gauge show loads that are there or that come and go, by what is known so far?
bool LiveMisfit::shows_load(const Eigen::VectorXd& at, const Eigen::MatrixXd& covariance) const {
  const auto j = static_cast<Eigen::Index>(*gauge_);
  return inflation()[j] > most_varied || std::abs(at[j]) > alarm_at * std::sqrt(covariance(j, j)) + gauge_digit_;
}

/// What each signal alone says in the last so many slots.
std::vector<LiveMisfit::Equations> LiveMisfit::by_output(std::size_t slots) const {
  const Equations none{Eigen::MatrixXd::Zero(base_.rows(), base_.cols()), Eigen::VectorXd::Zero(base_.rows())};
  std::vector<Equations> signals(old_.size(), none);
  for (std::size_t k = filled_ - slots; k < filled_; ++k) {
    for (std::size_t o = 0; o < signals.size(); ++o) {
      const LagSums& sums = ring_[k].sums[o];
      if (sums.blocks() > 0) sums.weigh_into(signals[o].h, signals[o].g, colour_[o]);
    }
  }
  return signals;
}

/// Does a change of one unknown that explains one signal make another worse than chance could?
bool LiveMisfit::contradicts(const std::vector<Equations>& signals, Eigen::Index j, double change,
                             const Eigen::VectorXd& at) {
  return std::ranges::any_of(signals, [&](const Equations& e) {
    const double pull = e.g[j] - e.h.row(j).dot(at);
    return 2 * change * pull - change * change * e.h(j, j) < -alarm_at * alarm_at;
  });
}

LiveMisfit::Suspicion LiveMisfit::look(const Timeline& time, std::size_t slots) const {
  const Equations earlier = time.before(slots);
  Equations recent = time.recent(slots);
  const Eigen::Index n = base_.rows();
  // In units in which each unknown is known to about one.
  const Eigen::VectorXd size = (earlier.h + recent.h).diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd covariance = inverse_of(earlier.h);
  const Eigen::VectorXd at = covariance * earlier.g;
  const Eigen::VectorXd by = inflation();
  covariance = by.asDiagonal() * covariance * by.asDiagonal();
  if (gauge_ && (loaded_ || shows_load(at, covariance))) {  // then the load is known, whatever it is
    const auto j = static_cast<Eigen::Index>(*gauge_);
    recent.h.row(j).setZero();
    recent.h.col(j).setZero();
    recent.g[j] = 0;
  }
  for (Eigen::Index i = 0; i < n; ++i) {  // what moves by itself
    if (digits_[i] > 0) {
      covariance(i, i) += digits_[i] * digits_[i] / 6;
    } else {
      const double slack = slack_of(static_cast<std::size_t>(i));
      covariance(i, i) += slack * slack;
    }
  }
  covariance = size.cwiseInverse().asDiagonal() * covariance * size.cwiseInverse().asDiagonal();
  // H = L Lᵀ; L⁺ y has a covariance of about one, and no part that H does not inform.
  const Eigensystem eigen = eigensystem(size.asDiagonal() * recent.h * size.asDiagonal());
  Eigen::Index first = 0;
  while (first < n && eigen.values[first] < 1e-9 * eigen.values[n - 1]) ++first;
  const Eigen::Index rank = n - first;
  if (rank == 0 || !(eigen.values[n - 1] > 0)) return {};
  const Eigen::VectorXd root = eigen.values.tail(rank).cwiseSqrt();
  const Eigen::MatrixXd vectors = eigen.vectors.rightCols(rank);
  const Eigen::MatrixXd l = vectors * root.asDiagonal();
  const Eigen::VectorXd y =
      root.cwiseInverse().asDiagonal() * (vectors.transpose() * (size.asDiagonal() * (recent.g - recent.h * at)));
  const Eigen::MatrixXd bent = root.cwiseInverse().asDiagonal() * product(vectors.transpose() * by.asDiagonal(), l);
  Eigen::MatrixXd s = product(bent, bent.transpose()) + product(l.transpose(), covariance * l);
  s.diagonal().array() += 0.05;  // also where the inflations cancel
  const Eigen::MatrixXd lower = cholesky(s);
  const Eigen::VectorXd white = solve_lower(lower, y);
  Suspicion found;
  struct Scored {
    LiveSuspect suspect;
    std::size_t direction;
    double drop;  ///< of the squares
  };
  std::vector<Scored> all;
  std::vector<bool> contradicted;
  std::vector<Equations> signals;  // needed only where something is suspected
  for (std::size_t j = 0; j < directions_.size(); ++j) {
    const Direction& d = directions_[j];
    if (!d.may_change) continue;
    const Eigen::VectorXd a = solve_lower(lower, l.row(static_cast<Eigen::Index>(j)).transpose());
    const double information = a.squaredNorm();
    if (!(information > 1e-12)) continue;
    const double unit = size[static_cast<Eigen::Index>(j)];
    const double change = a.dot(white) / information * unit;
    const double value = value_of_direction(j) + at[static_cast<Eigen::Index>(j)] + change;
    if (!std::isfinite(change) || value < d.low || value > d.high) continue;
    const double score = std::abs(a.dot(white)) / std::sqrt(information);
    found.score = std::max(found.score, score);
    if (score < doubtful_at) continue;
    // What it takes of the squares that are there, whatever uncertainty may excuse.
    const auto i = static_cast<Eigen::Index>(j);
    const double pull = recent.g[i] - recent.h.row(i).dot(at);
    all.push_back({{d.name, d.unit, change, unit / std::sqrt(information), score}, j, pull * pull / recent.h(i, i)});
    if (signals.empty()) signals = by_output(slots);
    contradicted.push_back(contradicts(signals, i, pull / recent.h(i, i), at));
  }
  if (std::ranges::find(contradicted, false) != contradicted.end()) {
    std::size_t k = 0;
    std::erase_if(all, [&](const Scored&) { return contradicted[k++]; });
  }
  if (all.empty()) return found;
  std::ranges::sort(all, std::greater{}, &Scored::drop);
  found.drop = all.front().drop;
  // Of those that explain it alike, first what the data say most surely.
  const auto tied = std::ranges::find_if(all, [&](const Scored& x) { return x.drop < (1 - tied_within) * found.drop; });
  std::ranges::sort(all.begin(), tied, std::greater{}, [](const Scored& x) { return x.suspect.score; });
  for (const Scored& x : all) {
    if (found.suspects.size() == most_tied || x.drop < (1 - tied_within) * found.drop) break;
    found.suspects.push_back(x.suspect);
    found.directions.push_back(x.direction);
  }
  return found;
}

LiveChange LiveMisfit::change_of(const Suspicion& suspicion) const {
  const Slot& first = ring_[filled_ - suspicion.slots];
  LiveChange change{.since = first.run == run_ ? first.begin : 0, .noticed = pass_.t(), .suspects = suspicion.suspects};
  double weight = 0;
  for (std::size_t k = filled_ - suspicion.slots; k < filled_; ++k) {
    weight += ring_[k].weight;
    change.omega += ring_[k].omega;
    change.i_a += ring_[k].i_a;
  }
  if (weight > 0) {
    change.omega /= weight;
    change.i_a /= weight;
  }
  return change;
}

void LiveMisfit::evaluate() {
  const Timeline time = timeline();
  const Equations all = time.before(0);
  // Where the model itself is, without what it lacks.
  const Eigen::MatrixXd covariance = inverse_of(all.h(of_model_, of_model_));
  const Eigen::VectorXd x = covariance * all.g(of_model_);
  expects_.setZero();
  if (!x.allFinite()) return clear();
  expects_(of_model_) = x;
  if (slots_seen_ >= learn_slots / 2) look_for_effects(all, covariance);
  if (slots_seen_ < learn_slots) return;

  if (gauge_ && !loaded_) {
    const Equations before = time.before(std::min<std::size_t>(filled_, recent_slots / 2));
    const Eigen::MatrixXd known = inverse_of(before.h);
    loaded_ = shows_load(known * before.g, known);
  }
  Suspicion worst;
  double most = 0;
  for (const std::size_t slots : splits) {
    if (slots + learn_slots / 2 > slots_seen_ || slots > filled_) break;
    Suspicion s = look(time, slots);
    s.slots = slots;
    most = std::max(most, s.score);
    // Of the moments at which it may have been, the one with which a single change explains most.
    const bool better = s.score >= alarm_at ? worst.score < alarm_at || (1 - tied_within) * s.drop > worst.drop
                                            : worst.score < alarm_at && s.score > worst.score;
    if (better) worst = std::move(s);
  }
  score_ = most;
  standing_ = worst.score >= alarm_at ? standing_ + 1 : 0;
  if (score_ < doubtful_at) colour_ = heard_;
  if (standing_ > 0 && (!own_ || slots_seen_ < own_slots)) return clear();  // the motor is not known yet
  if (standing_ >= alarm_looks) {
    standing_ = 0;
    changed_slots_ = worst.slots;
    if (changes_.size() == most_told) changes_.erase(changes_.begin());
    changes_.push_back(change_of(worst));
    news_.push_back(changes_.back());
  } else if (own_ && score_ < doubtful_at &&
             x.dot(all.h(of_model_, of_model_) * x) > static_cast<double>(of_model_.size())) {
    move_point(expects_);
  }
}

void LiveMisfit::follow_change() {
  ++changed_slots_;
  const Timeline time = timeline();
  Suspicion now = look(time, changed_slots_);
  now.slots = changed_slots_;
  score_ = now.score;
  if (now.score >= alarm_at) {
    const double noticed = changes_.back().noticed;
    changes_.back() = change_of(now);
    changes_.back().noticed = noticed;
  }
  if (changed_slots_ >= follow_slots) settle_into_change();
}

void LiveMisfit::settle_into_change() {
  const Timeline time = timeline();
  const Equations earlier = time.before(changed_slots_);
  const Suspicion change = look(time, changed_slots_);
  Eigen::MatrixXd covariance = inverse_of(earlier.h);
  Eigen::VectorXd at = covariance * earlier.g;
  const Eigen::VectorXd by = inflation();
  covariance = by.asDiagonal() * covariance * by.asDiagonal();
  for (std::size_t k = 0; k < change.suspects.size(); ++k) {
    const auto j = static_cast<Eigen::Index>(change.directions[k]);
    const double size = change.suspects[k].change;
    covariance(j, j) += 4 * size * size;
    if (k == 0) at[j] += size;
  }
  const bool explained = !change.suspects.empty() && at.allFinite() && covariance.allFinite();
  const Eigen::VectorXd scatter = scatter_, expected = expected_;
  clear();
  own_ = false;  // it is learnt anew what it has become
  if (!explained) return;
  scatter_ = scatter;
  expected_ = expected;
  base_ = inverse_of(covariance);
  base_g_ = base_ * at;
  move_point(at);
}

/// @param covariance of the unknowns of the model as it is
void LiveMisfit::look_for_effects(const Equations& all, const Eigen::MatrixXd& covariance) {
  points_to_.clear();
  double squares = 0, blocks = 0;
  for (std::size_t o = 0; o < old_.size(); ++o) {
    LagSums sum = old_[o];
    for (std::size_t k = 0; k < filled_; ++k) sum.add(ring_[k].sums[o]);
    squares += sum.cost(expects_, colour_[o]);
    blocks += sum.blocks();
  }
  const double excess = squares - blocks;
  const Eigen::VectorXd by = inflation();
  for (std::size_t j = 0; j < directions_.size(); ++j) {
    const Direction& d = directions_[j];
    const auto i = static_cast<Eigen::Index>(j);
    if (d.in_model || j == gauge_) continue;  // what a gauge shows is known
    const Eigen::VectorXd with = all.h(of_model_, i);
    const double information = all.h(i, i) - with.dot(covariance * with);
    const double left = all.g[i] - with.dot(expects_(of_model_));
    if (!(information > 1e-6 * all.h(i, i))) continue;  // the model's own parameters take its place
    const double value = left / information, drop = left * left / information;
    if (value < d.low || value > d.high || drop < material_share * excess) continue;
    const double std_error = by[i] / std::sqrt(information);
    const double score = std::abs(value) / std_error;
    if (score >= alarm_at) points_to_.push_back({d.name, d.unit, value, std_error, score});
  }
  std::ranges::sort(points_to_, std::greater{}, &LiveSuspect::score);
  if (points_to_.size() > most_tied) points_to_.resize(most_tied);
}

void LiveMisfit::learn(std::span<const double> values) {
  if (own_ || changed_slots_ > 0) return;
  Eigen::VectorXd d = Eigen::VectorXd::Zero(base_.rows());
  bool far = false;
  for (std::size_t j = 0; j < plan_.moved.size(); ++j) {
    if (!directions_[j].in_model) continue;
    const double from = value_of_direction(j), to = values[*directions_[j].at];
    d[static_cast<Eigen::Index>(j)] = to - from;
    const std::string& name = directions_[j].name;
    far = far || ((name == "R_a" || name == "K_b" || name == "K_m" || name == "J") &&
                  std::abs(to - from) > gross_share * std::abs(from));
  }
  move_point(d);
  if (far) {
    clear();
    taught_ = 0;
  }
}

/// The unknowns count from another point. @param d of which only the model's own parameters move
void LiveMisfit::move_point(Eigen::VectorXd d) {
  if (!d.allFinite()) return;
  for (std::size_t j = 0; j < static_cast<std::size_t>(d.size()); ++j) {
    const auto i = static_cast<Eigen::Index>(j);
    if (j >= plan_.moved.size() || !directions_[j].in_model) {
      d[i] = 0;
      continue;
    }
    const double from = value_of_direction(j);
    const double to = std::clamp(from + d[i], directions_[j].low, directions_[j].high);
    d[i] = to - from;
    for (const std::size_t place : plan_.moved[j]) point_[place] = to;
  }
  pass_.follow(point_);
  for (LagSums& sums : old_) sums.move_point(d);
  for (Slot& slot : ring_) {
    for (LagSums& sums : slot.sums) sums.move_point(d);
  }
  base_prior_g_ -= base_prior_ * d;
  base_g_ -= base_ * d;
  expects_ -= d;
}

LiveMisfitReport LiveMisfit::report() const {
  LiveMisfitReport r;
  r.watching = slots_seen_ >= learn_slots && changed_slots_ == 0;
  r.score = score_;
  r.changes = changes_;
  r.points_to = points_to_;
  const auto tell = [&](Signal against, const Grid& grid) {
    for (std::size_t b = 0; b < Grid::bins; ++b) {
      LiveBin bin{.against = against, .normalised = {}};
      bin.from = grid.reach * (2.0 * static_cast<double>(b) / Grid::bins - 1);
      bin.to = bin.from + 2 * grid.reach / Grid::bins;
      for (std::size_t o = 0; o < plan_.outputs.size(); ++o) {
        const Grid::Cell& cell = grid.cells[b][o];
        if (cell.weight >= 5) bin.normalised[plan_.outputs[o].signal] = std::sqrt(cell.squares / cell.weight);
      }
      if (!bin.normalised.empty()) r.where.push_back(std::move(bin));
    }
  };
  tell(Signal::omega, by_speed_);
  tell(Signal::i_a, by_current_);
  return r;
}

std::vector<LiveChange> LiveMisfit::news() { return std::exchange(news_, {}); }

}  // namespace emtb
