#include "experiment/profile.h"

#include <algorithm>
#include <cmath>

#include "experiment/splitmix64.h"
#include "hal/error.h"

namespace emtb {
namespace {

/// [s], [V] Drawn times and levels fall on this grid. Coarser than any rounding of the arithmetic, so that a compiler
/// which fuses multiply and add still gives the same profile; finer than a 12 bit output can follow.
constexpr double grid = 1e-3;

std::string words(double value) {
  std::string digits = std::to_string(value);
  digits.erase(digits.find_last_not_of('0') + 1);
  if (digits.back() == '.') digits.pop_back();
  return digits;
}

/// Rest, whatever `add` draws, and rest again.
class Builder {
 public:
  explicit Builder(double rest) : rest_(rest) {}

  void hold(double level, double duration) {
    knots_.push_back({t_, level});
    knots_.push_back({t_ += duration, level});
  }
  void ramp_to(double level, double rate) {
    t_ += std::abs(level - knots_.back().value) / rate;
    knots_.push_back({t_, level});
  }
  void rest(double duration) { hold(rest_, duration); }

  Profile build(std::string name) && { return {std::move(name), std::move(knots_)}; }

 private:
  double rest_;
  double t_ = 0;
  std::vector<Knot> knots_;
};

double draw(SplitMix64& random, double low, double high) {
  const double value = std::round((low + (high - low) * random.uniform()) / grid) * grid;
  return std::clamp(value, low, high);
}

}  // namespace

Profile::Profile(std::string name, std::vector<Knot> knots) : name_(std::move(name)), knots_(std::move(knots)) {
  if (knots_.empty()) throw ConfigError("profile " + name_ + ": has no knot. Give at least one");
  for (std::size_t i = 0; i < knots_.size(); ++i) {
    const Knot& knot = knots_[i];
    if (!std::isfinite(knot.t) || !std::isfinite(knot.value)) {
      throw ConfigError("profile " + name_ + ": knot " + std::to_string(i + 1) + " is not finite");
    }
    if (i > 0 && knot.t < knots_[i - 1].t) {
      throw ConfigError("profile " + name_ + ": time runs backwards from " + words(knots_[i - 1].t) + " s to " +
                        words(knot.t) + " s at knot " + std::to_string(i + 1) + ". Durations must be 0 or more");
    }
  }
}

double Profile::reference(double t) const noexcept {
  const auto after = std::ranges::upper_bound(knots_, t, {}, &Knot::t);  // the first knot later than t
  if (after == knots_.begin()) return knots_.front().value;
  const Knot& from = *(after - 1);
  if (after == knots_.end()) return from.value;
  return from.value + (after->value - from.value) * ((t - from.t) / (after->t - from.t));
}

double Profile::min() const noexcept { return std::ranges::min(knots_, {}, &Knot::value).value; }
double Profile::max() const noexcept { return std::ranges::max(knots_, {}, &Knot::value).value; }

Profile step(std::string name, double level, double before, double hold, double after, double rest) {
  return staircase(std::move(name), std::span(&level, 1), before, hold, after, rest);
}

Profile ramp(std::string name, double level, double rate, double before, double hold, double after, double rest) {
  if (!(rate > 0)) throw ConfigError("profile " + name + ": rate is " + words(rate) + " V/s. Give one above 0");
  Builder profile(rest);
  profile.rest(before);
  profile.ramp_to(level, rate);
  profile.hold(level, hold);
  profile.ramp_to(rest, rate);
  profile.rest(after);
  return std::move(profile).build(std::move(name));
}

Profile staircase(std::string name, std::span<const double> levels, double before, double hold, double after,
                  double rest) {
  Builder profile(rest);
  profile.rest(before);
  for (const double level : levels) profile.hold(level, hold);
  profile.rest(after);
  return std::move(profile).build(std::move(name));
}

Profile random_steps(std::string name, double low, double high, double shortest, double longest, double before,
                     double total, double after, std::uint64_t seed, double rest) {
  const auto complain = [&name](const std::string& what) { throw ConfigError("profile " + name + ": " + what); };
  if (!(low <= high)) complain("low is " + words(low) + " V, but high is " + words(high) + " V. Exchange them");
  if (!(shortest >= grid)) complain("shortest is " + words(shortest) + " s. Give 0.001 s or more");
  if (!(shortest <= longest)) {
    complain("shortest is " + words(shortest) + " s, but longest is " + words(longest) + " s. Exchange them");
  }
  if (!(total >= 0 && total / shortest <= most_levels)) {
    complain("total is " + words(total) + " s. Give 0 s to " + words(most_levels * shortest) + " s");
  }
  SplitMix64 random(seed);
  Builder profile(rest);
  profile.rest(before);
  for (double left = total; left > grid / 2;) {  // not 0: differences of decimals rarely are
    const double level = draw(random, low, high);
    const double held = std::min(draw(random, shortest, longest), left);
    profile.hold(level, held);
    left -= held;
  }
  profile.rest(after);
  return std::move(profile).build(std::move(name));
}

}  // namespace emtb
