#include "drivers/simulated/world.h"

#include <algorithm>
#include <cmath>

namespace emtb::simulated {
namespace {

constexpr double microsecond = 1e-6;

/// [s] A plant that nobody looked at for longer has settled, so that catching up need not take longer than this.
constexpr double longest_absence = 30;

}  // namespace

World::World(PlantParameters parameters, std::shared_ptr<const Clock> clock, std::uint64_t seed)
    : plant_(std::move(parameters)), clock_(std::move(clock)), seed_(seed) {}

void World::restart() noexcept {
  const Lock lock(busy_);
  restarted_ = true;
}

void World::set_reference(double volts) noexcept {
  const Lock lock(busy_);
  advance();
  reference_ = volts;
}

void World::force_reference(double volts) noexcept {
  if (!busy_.test_and_set(std::memory_order_acquire)) {
    advance();
    reference_ = volts;
    busy_.clear(std::memory_order_release);
  } else {
    reference_ = volts;
  }
}

void World::attach(Observer* observer) {
  const Lock lock(busy_);
  observers_.push_back(observer);
}

void World::detach(Observer* observer) {
  const Lock lock(busy_);
  std::erase(observers_, observer);
}

double World::advance() noexcept {
  const double t = clock_->now();
  if (origin_) advance_to(t);
  if (restarted_) {
    restarted_ = false;
    origin_ = t;
    steps_ = 0;
    for (Observer* observer : observers_) observer->begin(t, plant_);
  }
  return t;
}

void World::advance_to(double t) noexcept {
  const auto step_at = [this](double time) {
    return static_cast<std::int64_t>(std::llround((time - *origin_) / microsecond));
  };
  const auto go = [this](std::int64_t step) {
    if (step <= steps_) return;
    plant_.advance(static_cast<double>(step - steps_) * microsecond, reference_.load());
    steps_ = step;
  };
  const std::int64_t end = step_at(t);
  steps_ = std::max(steps_, end - static_cast<std::int64_t>(longest_absence / microsecond));
  while (true) {
    const auto next = std::ranges::min_element(observers_, {}, &Observer::due);
    // Within half a step counts as due: a window that ends with this tick belongs to it.
    if (next == observers_.end() || (*next)->due() > t + microsecond / 2) break;
    go(step_at((*next)->due()));
    (*next)->look(plant_);
  }
  go(end);
}

}  // namespace emtb::simulated
