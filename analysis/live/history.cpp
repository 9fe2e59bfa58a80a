#include "analysis/live/history.h"

#include <cmath>
#include <utility>

namespace emtb {
namespace {

constexpr double late_block = 0.02;           ///< [s] that a card which sends blocks may lag behind; by hand
constexpr double first_speed_within = 0.035;  ///< [s] in which LivePass reads the first speed, and some more

}  // namespace

double LiveTick::*LiveTick::member_of(Signal signal) {
  switch (signal) {
    case Signal::e_a:
      return &LiveTick::e_a;
    case Signal::i_a:
      return &LiveTick::i_a;
    case Signal::omega:
      return &LiveTick::omega;
    case Signal::torque:
      return &LiveTick::torque;
    case Signal::temperature:
      return &LiveTick::temperature;
    default:
      return nullptr;
  }
}

LiveHistory::LiveHistory(std::size_t ticks, double rate)
    : capacity_(ticks),
      late_(static_cast<std::size_t>(std::ceil(late_block * rate))),
      look_ahead_(static_cast<std::size_t>(first_speed_within * rate) + 4),
      chapters_(2) {
  for (LiveChapter& chapter : chapters_) {
    chapter.ticks.reserve(capacity_ + look_ahead_ + late_ + 2);
    chapter.readings.reserve(capacity_ / 2 + 16);
  }
}

void LiveHistory::add(const LiveTick& tick) {
  auto& ticks = current().ticks;
  if (tick.kind != LiveTick::Kind::next) restart_ = ticks.size();
  ticks.push_back(tick);
}

bool LiveHistory::put(Signal signal, double t, double value, double farthest) {
  auto& ticks = current().ticks;
  std::size_t k = ticks.size() - 1;
  const std::size_t first = ticks.size() > late_ ? ticks.size() - late_ : 0;
  while (k > first && ticks[k].kind != LiveTick::Kind::run_start &&
         std::abs(ticks[k - 1].t - t) < std::abs(ticks[k].t - t)) {
    --k;
  }
  if (std::abs(ticks[k].t - t) > farthest) return false;
  ticks[k].*LiveTick::member_of(signal) = value;
  return true;
}

void LiveHistory::put_slow(std::size_t output, double begin, double end, double value) {
  LiveChapter& chapter = current();
  if (chapter.readings.size() == chapter.readings.capacity()) return;
  chapter.readings.push_back({chapter.ticks.size(), output, begin, end, value});
}

std::size_t LiveHistory::complete() const {
  const std::size_t size = chapters_.back().ticks.size();
  if (size - restart_ < look_ahead_ + late_) return restart_;
  return size - late_;
}

bool LiveHistory::chapter_full() const {
  const std::size_t size = chapters_.back().ticks.size();
  return size >= capacity_ && size - restart_ >= look_ahead_ + late_;
}

void LiveHistory::begin_chapter(const std::vector<Machine<WideSensitive>>& machines) {
  std::swap(chapters_.front(), chapters_.back());
  LiveChapter& chapter = current();
  chapter.ticks.clear();
  chapter.readings.clear();
  chapter.machines.clear();
  chapter.machines.reserve(machines.size());
  for (const auto& machine : machines) chapter.machines.push_back(machine);
  restart_ = 0;
}

}  // namespace emtb
