#include "analysis/live/pass.h"

#include <algorithm>
#include <cmath>

namespace emtb {
namespace {

constexpr double innovation_memory = 1;  ///< [s] of the normalised innovation; by hand

}  // namespace

void LivePass::Block::clear() {
  residual = 0;
  readings = 0;
  for (auto& s : sum) s = WideSensitive(0.0);
}

LivePass::LivePass(const LivePlan& plan, LiveRows& rows)
    : plan_(plan),
      rows_(rows),
      motor_(plan),
      windows_(plan),
      blocks_(plan.outputs.size()),
      row_before_(plan.outputs.size()),
      meter_before_(plan.outputs.size()),
      floor_(plan.outputs.size()),
      innovation_(plan.outputs.size()),
      row_(static_cast<Eigen::Index>(plan.unknowns())),
      step_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(plan.unknowns()))) {
  for (Block& block : blocks_) block.sum.resize(motor_.machine_count());
  for (RowBefore& row : row_before_) row.s = step_;
}

void LivePass::begin(std::span<const double> values) {
  motor_.follow(values);
  motor_.renew();
  for (auto& innovation : innovation_) innovation = {};
  for (DifferenceFloor& floor : floor_) floor = {};
  chapter_ = tick_ = reading_ = 0;
  begun_ = false;
  step_.setZero();
  interrupt();
}

/// What follows has no neighbour before it.
void LivePass::interrupt() {
  for (Block& block : blocks_) block.clear();
  for (RowBefore& row : row_before_) row.there = false;
  for (MeterBefore& meter : meter_before_) meter.predicted = LiveTick::none;
  for (DifferenceFloor& floor : floor_) floor.interrupt();
  in_block_ = 0;
  windows_.interrupt();
}

void LivePass::forget_chapter() {
  if (in_first_chapter()) {
    begin(std::vector<double>(values()));
  } else {
    --chapter_;
  }
}

bool LivePass::find_next(const std::vector<LiveChapter>& history, std::size_t end) {
  const auto complete = [&](std::size_t chapter) {
    return chapter + 1 == history.size() ? end : history[chapter].ticks.size();
  };
  while (tick_ >= complete(chapter_)) {
    if (chapter_ + 1 == history.size() || tick_ < history[chapter_].ticks.size()) return false;
    ++chapter_;
    tick_ = reading_ = 0;
  }
  return true;
}

bool LivePass::advance(const std::vector<LiveChapter>& history, std::size_t end) {
  if (!find_next(history, end)) return false;
  const LiveChapter& chapter = history[chapter_];
  move_motor(chapter);
  windows_.add(motor_);
  compare_fast(chapter.ticks[tick_]);
  while (reading_ < chapter.readings.size() && chapter.readings[reading_].after <= tick_) {
    compare_slow(chapter.readings[reading_++]);
  }
  ++tick_;
  return true;
}

void LivePass::move_motor(const LiveChapter& chapter) {
  const LiveTick& now = chapter.ticks[tick_];
  if (begun_ && now.kind == LiveTick::Kind::next) return motor_.step_to(now);
  const std::span<const LiveTick> ahead =
      std::span(chapter.ticks).subspan(tick_, std::min(motor_.look_ahead(), chapter.ticks.size() - tick_));
  if (now.kind == LiveTick::Kind::run_start) {
    motor_.start_run(ahead);
  } else if (!begun_) {
    motor_.resume(chapter.machines, ahead);
  } else {
    motor_.bridge_gap(ahead);
  }
  interrupt();
  begun_ = true;
}

void LivePass::compare_fast(const LiveTick& now) {
  for (std::size_t o = 0; o < plan_.outputs.size(); ++o) {
    if (plan_.outputs[o].slow) continue;
    const Signal signal = plan_.outputs[o].signal;
    const double measured = now.at(signal);
    if (!motor_.settled() || !std::isfinite(measured)) continue;
    Block& block = blocks_[o];
    block.residual += measured - motor_.reading(signal);
    const auto& machines = motor_.machines();
    for (std::size_t g = 0; g < machines.size(); ++g) block.sum[g] += machines[g].readings().of(signal);
    ++block.readings;
  }
  if (++in_block_ >= plan_.block) close_blocks();
}

void LivePass::close_blocks() {
  in_block_ = 0;
  rows_.end_block();
  for (std::size_t o = 0; o < plan_.outputs.size(); ++o) {
    if (!plan_.outputs[o].slow) close_block(o);
  }
}

void LivePass::close_block(std::size_t output) {
  Block& block = blocks_[output];
  if (2 * block.readings > plan_.block) {
    const double each = 1 / static_cast<double>(block.readings);
    row_.setZero();
    for (std::size_t j = 0; j < plan_.moved.size(); ++j) {
      row_.data()[j] = block.sum[j / SimulatedMotor::lanes].d[j % SimulatedMotor::lanes] * each;
    }
    add_direct(output);
    floor_[output].add(block.residual * each);
    give_row(output, block.residual * each, static_cast<double>(plan_.block) * plan_.period);
  } else {
    floor_[output].interrupt();
    row_before_[output].there = false;
  }
  block.clear();
}

void LivePass::compare_slow(const SlowReading& reading) {
  const std::size_t o = reading.output;
  row_.setZero();
  const std::optional<double> predicted = windows_.mean(reading, row_);
  if (!predicted) return;
  MeterBefore& before = meter_before_[o];
  const double moved = std::abs(*predicted - before.predicted);
  // The same digits for the same current say nothing new: a resolution's error is no noise that averages away.
  if (reading.value == before.read && moved < 0.5 * plan_.outputs[o].lsb) return;
  // What moves is rounded now up, now down; what stands, always alike.
  if (moved < plan_.outputs[o].lsb) row_.data()[plan_.outputs[o].offset] = 1;
  add_direct(o);
  before = {.predicted = *predicted, .read = reading.value};
  give_row(o, reading.value - *predicted, reading.end - reading.begin);
}

void LivePass::add_direct(std::size_t output) {
  for (std::size_t k = 0; k < plan_.direct.size(); ++k) {
    if (plan_.direct[k] == plan_.outputs[output].signal) row_.data()[plan_.moved.size() + k] = 1;
  }
}

void LivePass::innovate(std::size_t output, double residual, double seconds) {
  const double left = residual - row_.dot(step_);
  LiveInnovationSums& sums = innovation_[output];
  const double kept = std::exp(-seconds / innovation_memory);
  sums.value = left;
  sums.square = kept * sums.square + left * left;
  sums.weight = kept * sums.weight + 1;
}

/// A motor that stands tells nothing, its noise neither.
bool LivePass::row_informs() const {
  double sum = 0;
  for (std::size_t j = 0; j < plan_.moved.size() + plan_.direct.size(); ++j) sum += std::abs(row_.data()[j]);
  return sum != 0;
}

void LivePass::give_row(std::size_t output, double residual, double seconds) {
  RowBefore& before = row_before_[output];
  if (!std::isfinite(residual) || !row_.allFinite()) {
    before.there = false;
    return;
  }
  innovate(output, residual, seconds);
  if (!row_informs()) {
    before.there = false;
    return;
  }
  rows_.take({.output = output,
              .chapter = chapter_,
              .tick = tick_,
              .s = row_,
              .r = residual,
              .follows = before.there,
              .s_before = before.s,
              .r_before = before.r,
              .omega = motor_.machines()[0].omega.v,
              .i_a = motor_.machines()[0].i_a.v});
  before.s = row_;
  before.r = residual;
  before.there = true;
}

double LivePass::simulated(Signal signal) const {
  if (motor_.machines().empty()) return 0;
  double value = motor_.reading(signal);
  for (std::size_t j = 0; j < plan_.moved.size(); ++j) {
    value += motor_.derivative(signal, j) * step_[static_cast<Eigen::Index>(j)];
  }
  return value;
}

}  // namespace emtb
