#include "analysis/diagnose/remainder.h"

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include "analysis/diagnose/comes_again.h"
#include "analysis/diagnose/moves.h"

namespace emtb {

namespace {

/// Is what is left of a signal more than noise, and a share of it that matters?
bool is_a_share(const Loss& left, Signal signal, std::span<const Signal> inputs, const Materiality& rule) {
  return std::ranges::find(inputs, signal) == inputs.end() && remainder_in(left, signal, rule) &&
         !left.floor_is_upper_bound(signal) && left.share_left(signal) >= rule.remainder_share;
}

/// Over how many readings what is left of a signal stays alike; none where that is not known.
std::optional<double> readings_alike(const Dataset& data, const Loss& left, Signal signal) {
  if (!left.quality) return std::nullopt;
  const auto memory = left.quality->memory.find(signal);
  const Observation* o = data.train.front().find(signal);
  if (memory == left.quality->memory.end() || memory->second <= 0 || o == nullptr || o->size() < 2) return std::nullopt;
  return memory->second * static_cast<double>(o->size() - 1) / (o->end.back() - o->end.front());
}

}  // namespace

bool leaves_a_share(const Loss& left, std::span<const Signal> inputs, const Materiality& rule) {
  return std::ranges::any_of(left.signals(), [&](Signal signal) { return is_a_share(left, signal, inputs, rule); });
}

bool worth_a_name(const Dataset& data, const Model& model, const Loss& held_out, std::span<const Signal> inputs,
                  const Materiality& rule) {
  // Noise that keeps 0.97 from reading to reading is underrated by so much by differences, and lasts 33 readings.
  constexpr double coloured = 8, longest_noise = 33;
  constexpr double chance = 0.1;  // six runs tell no less than a thirtieth
  std::vector<Signal> unsure;
  for (const Signal signal : held_out.signals()) {
    if (!is_a_share(held_out, signal, inputs, rule)) continue;
    // Where the noise is only known to be no less than the floor, it may be all that is left: but not far above it, as
    // a large part of what the signal does, for longer than such noise lasts.
    const std::optional<double> alike = readings_alike(data, held_out, signal);
    const bool lasts_too_long = held_out.mean_square(signal) >= rule.mostly_model &&
                                held_out.share_left(signal) > rule.far_off && alike > longest_noise;
    // What is another in each reading no torque makes, and no voltage, whatever the instrument was thought to be.
    const bool hops = alike && 2 * *alike < 1;
    const bool may_be_noise = held_out.mean_square(signal) < coloured * coloured &&
                              (hops || (held_out.floor_is_lower_bound(signal) && !lasts_too_long));
    if (held_out.share_left(signal) > rule.disturbance_share && !may_be_noise) return true;
    unsure.push_back(signal);
  }
  if (unsure.empty()) return false;
  const Memories memory = held_out.quality ? held_out.quality->memory : Memories{};
  const std::map<Signal, ComingAgain> again = coming_again(data.all(), model, memory);
  return std::ranges::any_of(unsure, [&](Signal signal) {
    const ComingAgain& found = again.at(signal);
    const double mean = held_out.mean_square(signal);
    return found.share > rule.again * (mean - 1) / mean && found.chance <= chance;
  });
}

bool is_of_a_refused_law(std::span<const Candidate> candidates, double error) {
  constexpr double nearly_all = 0.9;
  const auto above_floor = [](double floors) { return std::max(0.0, floors * floors - 1); };
  return std::ranges::any_of(candidates, [&](const Candidate& c) {
    return !c.implausible.empty() && !says_how_late(c.score.effect) && c.held_out_error &&
           above_floor(*c.held_out_error) < (1 - nearly_all) * above_floor(error);
  });
}

}  // namespace emtb
