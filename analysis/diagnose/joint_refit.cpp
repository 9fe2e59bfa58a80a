#include "analysis/diagnose/joint_refit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "analysis/diagnose/null_fit.h"
#include "analysis/diagnose/refit.h"
#include "analysis/fit/rotor_phase.h"
#include "analysis/numerics/parallel.h"
#include "model/catalogue.h"

namespace emtb {
namespace {

constexpr int first_look = 2, few = 4;  // steps

std::size_t needed_by(const Model& model, std::size_t effect) { return effect_index(model.about(effect).needs); }

/// Moves those parameters that may move.
void move_to(std::span<const double> place, std::span<Parameter> parameters) {
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    Parameter& p = parameters[i];
    if (!p.fixed) p.value = std::clamp(place[i], p.min, p.max);
  }
}

Model with_both_at(const Model& fitted, std::size_t effect, std::span<const double> own,
                   std::span<const double> needed) {
  Model both = fitted;
  move_to(needed, both.parameters_of(needed_by(fitted, effect)));
  both.include(effect);
  move_to(own, both.parameters_of(effect));
  return both;
}

double squares_of(std::span<const Record> records, const Model& model, const RotorPhases& known) {
  return squares_at_best_phases(records, model, known).squares;
}

/// For each place of the effect, the best of some places of the one that it needs, as a simulation tells.
std::vector<Model> starts_of_both(std::span<const Record> records, const Model& fitted, std::size_t effect,
                                  std::span<const StartValues> own, std::span<const StartValues> needed,
                                  const RotorPhases& known) {
  std::vector<Model> starts;
  for (const StartValues& place : own) {
    double least = infinity;
    std::optional<Model> best;
    for (const StartValues& beside : needed) {
      Model both = with_both_at(fitted, effect, place, beside);
      const double squares = squares_of(records, both, known);
      if (!(squares < least)) continue;
      least = squares;
      best = std::move(both);
    }
    if (best) starts.push_back(std::move(*best));
  }
  return starts;
}

/// Has a fit left the effect behind? At its null or a bound it is absent, or all that there is.
bool leads_out_of(std::size_t effect, const Fit& fit) {
  return std::ranges::any_of(fit.model.parameters_of(effect),
                             [](const Parameter& p) { return !p.fixed && (p.value <= p.min || p.value >= p.max); });
}

/// The n-th number in [-1, 1] of a series that fills it evenly, another one for each prime: the radical inverse (van
/// der Corput).
double evenly(std::size_t n, std::size_t prime) {
  double sum = 0, digit = 1;
  for (; n > 0; n /= prime) {
    digit /= static_cast<double>(prime);
    sum += digit * static_cast<double>(n % prime);
  }
  return 2 * sum - 1;
}

/// The best few fits from places of both, begun.
std::vector<Fit> best_of_both(std::span<const Record> records, const Model& fitted, std::size_t effect,
                              std::span<const StartValues> own, std::span<const StartValues> needed,
                              const RotorPhases& known) {
  constexpr std::size_t best_few = 2;
  std::vector<Fit> begun;
  for (const Model& start : starts_of_both(records, fitted, effect, own, needed, known)) {
    begun.push_back(first_steps(records, start, first_look, known));
  }
  std::erase_if(begun, [&](const Fit& f) { return leads_out_of(effect, f); });
  std::ranges::stable_sort(begun, {}, &Fit::cost);
  begun.resize(std::min(best_few, begun.size()));
  for (Fit& f : begun) f = first_steps(records, f.model, few, known);
  return begun;
}

/// The same with the needed effect where it stands, and where a search for it would start: it may have bent a little or
/// out of all sense.
std::vector<Fit> begun_anywhere(std::span<const Record> records, const Model& fitted, std::size_t effect,
                                const RotorPhases& known) {
  const Ranges seen = ranges_of(records, fitted);
  const std::vector<StartValues> own = starts_beside_what_it_needs(effect, seen);
  StartValues as_fitted{};
  std::ranges::copy(values_of(fitted.parameters_of(needed_by(fitted, effect))), as_fitted.begin());
  std::vector<Fit> begun = best_of_both(records, fitted, effect, own, std::span(&as_fitted, 1), known);
  for (Fit& f : best_of_both(records, fitted, effect, own, starts_of(needed_by(fitted, effect), seen), known)) {
    begun.push_back(std::move(f));
  }
  return begun;
}

/// A fit that hops: of many places around it the best two are descended from, and so on from where that leads further
/// down; around a place from which nothing does, nearer.
class Hopping {
 public:
  Hopping(std::span<const Record> records, std::size_t effect, const RotorPhases& known, Fit start)
      : records_(records), effect_(effect), known_(known), fit_(std::move(start)) {}

  const Fit& fit() const { return fit_; }

  /// @param rounds at most
  void go_on(int rounds) {
    for (; rounds > 0 && reach_ > nearest; --rounds) {
      constexpr double further = 0.99;  // of the cost
      const double before = fit_.cost;
      hop();
      if (!(fit_.cost < further * before)) reach_ *= nearer;
    }
  }

 private:
  static constexpr double nearer = 0.4, nearest = 0.1;  // of the reach at first

  void hop() {
    constexpr std::size_t places = 32, descents = 2;
    std::vector<std::pair<double, Model>> around(places);
    for (auto& [squares, model] : around) model = next_place();
    parallel_for(places, [&](std::size_t i) { around[i].first = squares_of(records_, around[i].second, known_); });
    std::erase_if(around, [](const auto& place) { return !std::isfinite(place.first); });
    std::ranges::stable_sort(around, {}, &std::pair<double, Model>::first);
    around.resize(std::min(descents, around.size()));
    for (const auto& [squares, model] : around) {
      if (Fit there = first_steps(records_, model, few, known_); there.cost < fit_.cost) fit_ = std::move(there);
    }
  }

  /// Inertia and effect within a fifth, the effect that it needs, of which less is known, within two.
  Model next_place() {
    constexpr std::array<std::size_t, 8> primes{2, 3, 5, 7, 11, 13, 17, 19};
    constexpr double near = 0.2, farther = 0.4;  // logarithms of a ratio
    ++n_;
    Model place = fit_.model;
    std::size_t dimension = 0;
    const auto move = [&](Parameter& p, double most) {
      const double by = reach_ * most * evenly(n_, primes.at(dimension++));
      if (!p.fixed) p.value = std::clamp(p.value * std::exp(by), p.min, p.max);
    };
    move(place.base[base::J], near);
    for (Parameter& p : place.parameters_of(effect_)) move(p, near);
    for (Parameter& p : place.parameters_of(needed_by(place, effect_))) move(p, farther);
    return place;
  }

  std::span<const Record> records_;
  std::size_t effect_;
  const RotorPhases& known_;
  Fit fit_;
  std::size_t n_ = 0;  ///< places tried
  double reach_ = 1;   ///< of the next places
};

/// How many rounds of hops: all that lead on, but for long runs, of which a search simulates only so much.
int rounds_over(std::span<const Record> records) {
  constexpr double rows = 5e7, passes = 100;  // in all, a twentieth of a search's; and of a round
  constexpr int most = 12;
  double length = 0;
  for (const Record& record : records) length += static_cast<double>(record.length());
  return std::clamp(static_cast<int>(rows / (passes * length)), 1, most);
}

}  // namespace

Valley valley_of(const Model& fitted, std::size_t effect) {
  Valley valley{values_of(fitted.parameters_of(effect)), {}, values_of(fitted.base)};
  if (acts_within_another(fitted, effect)) valley.needed = values_of(fitted.parameters_of(needed_by(fitted, effect)));
  return valley;
}

bool acts_within_another(const Model& model, std::size_t effect) {
  const EffectInfo& about = model.about(effect);
  return about.at_null == AtNull::nothing && !about.needs.empty() && model.includes(effect_index(about.needs));
}

Fit begun_together(std::span<const Record> records, const Fit& fitted, std::size_t effect, const RotorPhases& known,
                   const Valley* valley) {
  constexpr int first_rounds = 3;
  const ShortestRecords part(records);
  const std::span<const Record> some = part.all();
  const int rounds = rounds_over(some);
  const RotorPhases known_there = part.of(known);
  std::vector<Fit> begun;
  if (valley != nullptr) {
    Model there = with_both_at(fitted.model, effect, valley->own, valley->needed);
    move_to(valley->base, there.base);
    begun.push_back(first_steps(some, there, few, known_there));
  } else {
    begun = begun_anywhere(some, fitted.model, effect, known_there);
  }
  std::optional<Hopping> best;
  for (Fit& f : begun) {
    if (!std::isfinite(f.cost)) continue;
    Hopping hopping(some, effect, known_there, std::move(f));
    hopping.go_on(std::min(first_rounds, rounds));
    if (!best || hopping.fit().cost < best->fit().cost) best.emplace(std::move(hopping));
  }
  if (!best) return nowhere(fitted.model);
  best->go_on(rounds - first_rounds);
  return first_steps(records, best->fit().model, few, known);
}

}  // namespace emtb
