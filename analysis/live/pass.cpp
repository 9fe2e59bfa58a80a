#include "analysis/live/pass.h"

#include <algorithm>
#include <cmath>

namespace emtb {
namespace {

constexpr std::size_t lanes = 2 * derivatives_per_pass;
constexpr double recent_memory = 5;   ///< [s] over which excitation is judged
constexpr double watch_memory = 1;    ///< [s] of the normalised innovation
constexpr double longest_bridge = 5;  ///< [s] of a gap that is simulated through: the slowest driver's full travel

/// The speed with which the readings begin: zero unless they say otherwise.
struct FirstSpeed {
  double value = 0;
  bool moves = false;
};
FirstSpeed first_speed(std::span<const LiveTick> ahead) {
  double sum = 0, squares = 0, n = 0;
  for (const LiveTick& tick : ahead) {
    if (!std::isfinite(tick.omega)) continue;
    sum += tick.omega;
    squares += tick.omega * tick.omega;
    ++n;
  }
  if (n < 3) return {};
  const double mean = sum / n;
  const double scatter = std::sqrt(std::max(0.0, squares / n - mean * mean) / (n - 1));
  if (std::abs(mean) <= 6 * scatter + 1e-9) return {};  // coloured noise: more than the scatter of the mean tells
  return {mean, true};
}

}  // namespace

double* LiveTick::place(Signal signal) {
  switch (signal) {
    case Signal::e_a:
      return &e_a;
    case Signal::i_a:
      return &i_a;
    case Signal::omega:
      return &omega;
    case Signal::torque:
      return &torque;
    case Signal::temperature:
      return &temperature;
    default:
      return nullptr;
  }
}

void DifferenceFloor::add(double r) {
  if (seen_ >= 1) {
    first_ += (r - before_) * (r - before_);
    ++firsts_;
  }
  if (seen_ >= 2) {
    second_ += (r - before_that_) * (r - before_that_);
    ++seconds_;
  }
  before_that_ = before_;
  before_ = r;
  seen_ = std::min(seen_ + 1, 2);
}

Colour DifferenceFloor::colour() const {
  constexpr double fewest = 20;    // differences that tell a colour
  constexpr double longest = 0.7;  // beyond that it is an error of the model that lasts
  if (firsts_ < 1 || first_ <= 0) return {.sigma = 0, .rho = 0};
  const double first = first_ / firsts_;
  const double rho = seconds_ < fewest ? 0 : std::clamp(second_ / seconds_ / first - 1, -0.5, longest);
  const double doubt = 1 + fewest / firsts_;  // the first few may all be small
  return {.sigma = std::sqrt(0.5 * first / (1 - rho) * doubt), .rho = rho};
}

LivePass::LivePass(const LivePlan& plan, LiveRows* rows)
    : plan_(plan),
      rows_(rows),
      p_((plan.moved.size() + lanes - 1) / lanes + (plan.moved.empty() ? 1 : 0)),
      sums_(2, std::vector(plan.seconds, std::vector<LagSums>(plan.outputs.size(),
                                                              LagSums(static_cast<Eigen::Index>(plan.unknowns()))))),
      row_before_(plan.outputs.size()),
      predicted_before_(plan.outputs.size()),
      read_before_(plan.outputs.size()),
      watch_(plan.outputs.size()),
      floor_(plan.outputs.size()),
      blocks_(plan.outputs.size()),
      row_(static_cast<Eigen::Index>(plan.unknowns())),
      step_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(plan.unknowns()))) {
  const auto n = static_cast<Eigen::Index>(plan.unknowns());
  recent_.assign(plan.outputs.size(), Eigen::MatrixXd::Zero(n, n));
  for (Block& block : blocks_) block.sum.resize(p_.size());
  for (Row& row : row_before_) row.s = Eigen::VectorXd::Zero(n);
  std::size_t slow = 0;
  for (const auto& output : plan.outputs) slow += output.slow ? 1 : 0;
  if (slow > 0) {
    integrals_.resize(static_cast<std::size_t>(plan.longest_window / plan.period) + 16);
    for (Integral& integral : integrals_) integral.value.assign(slow * 2 * (1 + plan.moved.size()), 0.0);
  }
  machines_.reserve(p_.size());
}

void LivePass::follow(std::span<const double> values) {
  values_.assign(values.begin(), values.end());
  for (std::size_t g = 0; g < p_.size(); ++g) {
    p_[g].assign(values.begin(), values.end());  // in the same place: machines look there
    for (std::size_t j = g * lanes; j < std::min(plan_.moved.size(), (g + 1) * lanes); ++j) {
      for (const std::size_t place : plan_.moved[j]) p_[g][place].d[j - g * lanes] = 1;
    }
  }
}

void LivePass::begin(std::span<const double> values) {
  follow(values);
  for (auto& chapter : sums_) {
    for (auto& second : chapter) {
      for (LagSums& sums : second) sums.clear();
    }
  }
  for (auto& recent : recent_) recent.setZero();
  for (Watch& watch : watch_) watch = {};
  for (DifferenceFloor& floor : floor_) floor = {};
  chapter_ = tick_ = reading_ = 0;
  begun_ = false;
  step_.setZero();
  interrupt();
  renew_machines();
}

void LivePass::renew_machines() {
  machines_.clear();
  for (const auto& p : p_) machines_.emplace_back(plan_.structure, std::span<const WideSensitive>(p));
}

void LivePass::interrupt() {
  for (Block& block : blocks_) {
    block.residual = 0;
    block.readings = 0;
    for (auto& sum : block.sum) sum = WideSensitive(0.0);
  }
  for (Row& row : row_before_) row.there = false;
  std::ranges::fill(predicted_before_, LiveTick::none);
  for (DifferenceFloor& floor : floor_) floor.interrupt();
  in_block_ = 0;
  stored_ = 0;
}

void LivePass::forget_chapter() {
  if (chapter_ == 0) {  // it had not got beyond what is gone
    begin(std::vector<double>(values_));
    return;
  }
  std::swap(sums_[0], sums_[1]);
  for (auto& second : sums_[1]) {
    for (LagSums& sums : second) sums.clear();
  }
  --chapter_;
}

bool LivePass::advance(const std::vector<LiveChapter>& history, std::size_t end) {
  const auto complete = [&](std::size_t chapter) {
    return chapter + 1 == history.size() ? end : history[chapter].ticks.size();
  };
  while (tick_ >= complete(chapter_)) {
    if (chapter_ + 1 == history.size() || tick_ < history[chapter_].ticks.size()) return false;
    ++chapter_;
    tick_ = reading_ = 0;
  }
  const LiveChapter& chapter = history[chapter_];
  const LiveTick& now = chapter.ticks[tick_];
  const auto look_ahead = static_cast<std::size_t>(std::lround(0.03 / plan_.period)) + 3;
  const std::span<const LiveTick> ahead =
      std::span(chapter.ticks).subspan(tick_, std::min(look_ahead, chapter.ticks.size() - tick_));
  if (now.kind == LiveTick::Kind::run_start) {
    start_run(ahead);
  } else if (!begun_) {
    machines_.clear();
    for (const auto& machine : chapter.machines) machines_.push_back(machine);
    for (std::size_t g = 0; g < machines_.size(); ++g) machines_[g].follow(p_[g]);
    if (machines_.empty()) {
      start_run(ahead);
    } else {
      before_ = now;
      e_a_ = std::isfinite(now.drive) ? now.drive : e_a_;
      bridge_gap(ahead);
    }
  } else if (now.kind == LiveTick::Kind::gap) {
    bridge_gap(ahead);
  } else {
    step_to(now);
  }
  begun_ = true;
  before_ = now;
  watch_tick(now);
  while (reading_ < chapter.readings.size() && chapter.readings[reading_].after <= tick_) {
    close_slow(chapter.readings[reading_++]);
  }
  ++tick_;
  return true;
}

void LivePass::start_run(std::span<const LiveTick> ahead) {
  const LiveTick& now = ahead.front();
  const FirstSpeed speed = first_speed(ahead);
  interrupt();
  renew_machines();
  e_a_ = std::isfinite(now.drive) ? now.drive : 0;
  unmeasured_ = 0;
  StepInput in{
      .u_ref = now.u_ref, .e_a_mean = e_a_, .e_a_end = e_a_, .angle_middle = {}, .angle_end = {}, .angle_pull = {}};
  in.i_a = std::isfinite(now.i_a) ? now.i_a : 0;
  in.load = now.load;
  in.omega = in.omega_end = speed.value;
  InitialState initial{
      .omega = speed.value, .theta = 0, .i_a = in.i_a, .e_driver = {}, .as_read = true, .field_on = now.field_on};
  if (plan_.structure.input == Signal::u_ref && plan_.structure.measured_voltage) initial.e_driver = e_a_;
  for (auto& machine : machines_) machine.start(initial, in);
  valid_from_ = now.t + (speed.moves ? plan_.settling : 0);
}

void LivePass::bridge_gap(std::span<const LiveTick> ahead) {
  // What the driver and whatever has a memory did meanwhile, as well as is known: the inputs held.
  LiveTick held = before_;
  const double until = ahead.front().t;
  held.t = std::max(before_.t, until - longest_bridge);
  before_.t = held.t;
  held.t = until;
  held.temperature = before_.temperature;
  if (until > before_.t) step_to(held);
  const FirstSpeed speed = first_speed(ahead);
  for (auto& machine : machines_) machine.omega = machine.omega_reading = WideSensitive(speed.value);
  interrupt();
  e_a_ = std::isfinite(ahead.front().drive) ? ahead.front().drive : e_a_;
  valid_from_ = until + plan_.settling;
}

void LivePass::step_to(const LiveTick& now) {
  double interval = now.t - before_.t;
  if (std::abs(interval - plan_.period) < 1e-6 * plan_.period) interval = plan_.period;  // rounding of even ticks
  const double e_a_before = e_a_;
  if (plan_.structure.measured_voltage) {
    if (std::isfinite(now.drive)) {
      e_a_ = now.drive;
      unmeasured_ = 0;
    } else if (++unmeasured_ == 6) {
      valid_from_ = now.t + plan_.settling;
    } else if (unmeasured_ > 6) {
      valid_from_ = std::max(valid_from_, now.t + plan_.settling);
    }
  }
  const int steps = std::max(1, static_cast<int>(std::ceil(interval / plan_.longest_step - 1e-6)));
  const double h = interval / steps;
  StepInput in{.u_ref = before_.u_ref, .angle_middle = {}, .angle_end = {}, .angle_pull = {}};
  in.i_a = std::isfinite(before_.i_a) ? before_.i_a : value_of(machines_.front().i_a);
  in.load = 0.5 * (before_.load + now.load);
  const double a = std::isfinite(before_.omega) ? before_.omega : value_of(machines_.front().omega);
  in.omega_end = std::isfinite(now.omega) ? now.omega : a;
  in.omega = 0.5 * (a + in.omega_end);
  in.temperature = before_.temperature;
  for (int s = 0; s < steps; ++s) {
    in.e_a_mean = e_a_before + (e_a_ - e_a_before) * (s + 0.5) / steps;
    in.e_a_end = e_a_before + (e_a_ - e_a_before) * (s + 1) / steps;
    for (auto& machine : machines_) machine.step(in, before_.t + s * h, h);
  }
}

void LivePass::watch_tick(const LiveTick& now) {
  const bool valid = now.t >= valid_from_;
  std::size_t slow = 0;
  const std::size_t n = plan_.moved.size();
  if (!integrals_.empty()) {
    const Integral& last = integrals_[newest_];
    const std::size_t next = (newest_ + 1) % integrals_.size();
    const double h = stored_ > 0 ? now.t - last.t : 0;
    integrals_[next].t = now.t;
    for (std::size_t o = 0; o < plan_.outputs.size(); ++o) {
      if (!plan_.outputs[o].slow) continue;
      double* to = integrals_[next].value.data() + slow * 2 * (1 + n);
      const double* from = last.value.data() + slow * 2 * (1 + n);
      const auto integrate = [&](std::size_t entry, double x) {
        to[2 * entry] = stored_ == 0 ? 0 : from[2 * entry] + 0.5 * h * (from[2 * entry + 1] + x);
        to[2 * entry + 1] = x;
      };
      integrate(0, machines_[0].readings().of(plan_.outputs[o].signal).v);
      for (std::size_t j = 0; j < n; ++j) {
        integrate(1 + j, machines_[j / lanes].readings().of(plan_.outputs[o].signal).d[j % lanes]);
      }
      ++slow;
    }
    newest_ = next;
    stored_ = std::min(stored_ + 1, integrals_.size());
    if (!valid) stored_ = std::min<std::size_t>(stored_, 1);  // windows begin where the states are right
  }
  for (std::size_t o = 0; o < plan_.outputs.size(); ++o) {
    if (plan_.outputs[o].slow) continue;
    const Signal signal = plan_.outputs[o].signal;
    const double measured = now.at(signal);
    if (!valid || !std::isfinite(measured)) continue;
    Block& block = blocks_[o];
    const double r = measured - machines_[0].readings().of(signal).v;
    block.residual += r;
    for (std::size_t g = 0; g < machines_.size(); ++g) block.sum[g] += machines_[g].readings().of(signal);
    ++block.readings;
  }
  if (++in_block_ >= plan_.block) close_blocks();
}

void LivePass::close_blocks() {
  in_block_ = 0;
  const double kept = std::exp(-static_cast<double>(plan_.block) * plan_.period / recent_memory);
  for (auto& recent : recent_) recent *= kept;
  for (std::size_t o = 0; o < plan_.outputs.size(); ++o) {
    if (plan_.outputs[o].slow) continue;
    Block& block = blocks_[o];
    const bool whole = 2 * block.readings > plan_.block;
    if (whole) {
      const double each = 1 / static_cast<double>(block.readings);
      row_.setZero();
      for (std::size_t j = 0; j < plan_.moved.size(); ++j) {
        row_.data()[j] = block.sum[j / lanes].d[j % lanes] * each;
      }
      add_direct(o);
      floor_[o].add(block.residual * each);
      take_row(o, block.residual * each, static_cast<double>(plan_.block) * plan_.period);
    } else {
      floor_[o].interrupt();
      row_before_[o].there = false;
    }
    block.residual = 0;
    block.readings = 0;
    for (auto& sum : block.sum) sum = WideSensitive(0.0);
  }
}

std::size_t LivePass::integral_at(double t) const {
  std::size_t at = newest_;
  for (std::size_t back = 0; back + 1 < stored_ && integrals_[at].t > t; ++back) {
    at = (at + integrals_.size() - 1) % integrals_.size();
  }
  return at;
}

void LivePass::close_slow(const SlowReading& reading) {
  if (stored_ < 2) return;
  const std::size_t oldest = (newest_ + integrals_.size() + 1 - stored_) % integrals_.size();
  if (reading.begin < integrals_[oldest].t - 0.75 * plan_.period) return;
  if (reading.end > integrals_[newest_].t + 1.5 * plan_.period) return;
  std::size_t slow = 0;
  for (std::size_t o = 0; o < reading.output; ++o) slow += plan_.outputs[o].slow ? 1 : 0;
  const std::size_t n = plan_.moved.size(), offset = slow * 2 * (1 + n);
  // Linear between ticks.
  const auto interpolate = [&](double t, std::size_t entry) {
    const std::size_t low = integral_at(t), high = low == newest_ ? low : (low + 1) % integrals_.size();
    const double a = integrals_[low].t, b = integrals_[high].t;
    const double share = b > a ? std::clamp((t - a) / (b - a), 0.0, 1.0) : 0.0;
    const double from = integrals_[low].value[offset + 2 * entry], to = integrals_[high].value[offset + 2 * entry];
    return from + share * (to - from);
  };
  const double each = 1 / (reading.end - reading.begin);
  row_.setZero();
  for (std::size_t j = 0; j < n; ++j) {
    row_.data()[j] = (interpolate(reading.end, 1 + j) - interpolate(reading.begin, 1 + j)) * each;
  }
  const double predicted = (interpolate(reading.end, 0) - interpolate(reading.begin, 0)) * each;
  // The same digits for the same current say nothing new: a resolution's error is no noise that averages away.
  const std::size_t o = reading.output;
  const bool again =
      reading.value == read_before_[o] && std::abs(predicted - predicted_before_[o]) < 0.5 * plan_.outputs[o].lsb;
  if (again) return;
  // What moves is rounded now up, now down; what stands, always alike.
  if (std::abs(predicted - predicted_before_[o]) < plan_.outputs[o].lsb) row_.data()[plan_.outputs[o].offset] = 1;
  add_direct(o);
  read_before_[o] = reading.value;
  predicted_before_[o] = predicted;
  take_row(o, reading.value - predicted, reading.end - reading.begin);
}

void LivePass::add_direct(std::size_t output) {
  for (std::size_t k = 0; k < plan_.direct.size(); ++k) {
    if (plan_.direct[k] == plan_.outputs[output].signal) row_.data()[plan_.moved.size() + k] = 1;
  }
}

void LivePass::take_row(std::size_t output, double residual, double seconds) {
  Row& before = row_before_[output];
  if (!std::isfinite(residual) || !row_.allFinite()) {
    before.there = false;
    return;
  }
  const double left = residual - row_.dot(step_);
  Watch& watch = watch_[output];
  const double kept = std::exp(-seconds / watch_memory);
  watch.value = left;
  watch.square = kept * watch.square + left * left;
  watch.weight = kept * watch.weight + 1;
  double informs = 0;
  for (std::size_t j = 0; j < plan_.moved.size() + plan_.direct.size(); ++j) informs += std::abs(row_.data()[j]);
  if (informs == 0) {  // a motor that stands tells nothing, its noise neither
    before.there = false;
    return;
  }
  if (rows_ != nullptr) {
    rows_->take({.output = output,
                 .s = row_,
                 .r = residual,
                 .follows = before.there,
                 .s_before = before.s,
                 .r_before = before.r,
                 .omega = machines_[0].omega.v,
                 .i_a = machines_[0].i_a.v});
    before.s = row_;
    before.r = residual;
    before.there = true;
    return;
  }
  recent_[output].noalias() += row_ * row_.transpose();
  LagSums& sums = sums_[chapter_][std::min(tick_ / plan_.second, plan_.seconds - 1)][output];
  sums.add(row_, residual);
  if (before.there) sums.add_pair(before.s, before.r, row_, residual);
  before.s = row_;
  before.r = residual;
  before.there = true;
}

double LivePass::simulated(Signal signal) const {
  if (machines_.empty()) return 0;
  double value = machines_[0].readings().of(signal).v;
  for (std::size_t j = 0; j < plan_.moved.size(); ++j) {
    value += machines_[j / lanes].readings().of(signal).d[j % lanes] * step_[static_cast<Eigen::Index>(j)];
  }
  return value;
}

}  // namespace emtb
