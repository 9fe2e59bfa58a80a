#include "analysis/discover/law_experiment.h"

#include <algorithm>
#include <cmath>

#include "analysis/diagnose/foresee.h"

namespace emtb {
namespace {

/// What the motor comes to at some references.
struct Settled {
  std::vector<double> reference, value;
};

/// Of one quantity, speed or current, at even references of the bench.
std::optional<Settled> settled(const Model& model, const Reach& reach, Signal quantity, double hold) {
  constexpr int levels = 41;
  Settled all;
  for (int k = 0; k < levels; ++k) all.reference.push_back(std::lerp(reach.low, reach.high, k / (levels - 1.0)));
  const double interval = std::min(hold / 20, 0.02);
  const auto foreseen = foresee(model, staircase("levels", all.reference, 0, hold, 0), interval);
  if (!foreseen) return std::nullopt;
  const Trajectory<double>& y = foreseen->readings;
  const std::vector<double>&t = foreseen->excitation.t, &x = quantity == Signal::omega ? y.omega : y.i_a;
  for (int k = 0; k < levels; ++k) {
    const auto after = std::ranges::lower_bound(t, (k + 1) * hold - 0.5 * interval) - t.begin();
    all.value.push_back(x[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(after - 1, 0, std::ssize(x) - 1))]);
  }
  return all;
}

/// [V] at which the quantity comes to a value; none where no reference of the bench does.
std::optional<double> reference_for(const Settled& all, double value) {
  for (std::size_t k = 0; k + 1 < all.value.size(); ++k) {
    const double here = all.value[k] - value, next = all.value[k + 1] - value;
    if (here == 0) return all.reference[k];
    if (here * next > 0 || here == next) continue;
    return std::lerp(all.reference[k], all.reference[k + 1], here / (here - next));
  }
  return std::nullopt;
}

}  // namespace

std::optional<LawExperiment> law_experiment(const Law& law, const Reach& reach, double hold) {
  const std::string& over = law.text.of.front();
  if (law.most_uncertain_at.empty() || law.model.input != Signal::u_ref) return std::nullopt;
  if (over != "omega" && over != "i_a" && over != "u_ref") return std::nullopt;
  std::optional<Settled> all;
  if (over != "u_ref") {
    all = settled(law.model, reach, over == "omega" ? Signal::omega : Signal::i_a, hold);
    if (!all) return std::nullopt;
  }
  const double range = std::max(std::abs(law.at.front()), std::abs(law.at.back()));
  constexpr double beside = 0.04;  // of the range: a tenth of the distance of a curve's values, or less
  std::vector<double> levels, places;
  for (const double place : law.most_uncertain_at) {
    const std::size_t before = levels.size();
    for (const double off : {-beside, 0.0, beside}) {
      const double value = place + off * range;
      const std::optional<double> level = all ? reference_for(*all, value) : value;
      if (level && *level >= reach.low && *level <= reach.high) levels.push_back(*level);
    }
    if (levels.size() > before) places.push_back(place);
  }
  if (levels.empty()) return std::nullopt;
  std::vector<double> back(levels.rbegin(), levels.rend());
  const double rest = 0.5 * hold;
  const auto run = [&](const char* name, const std::vector<double>& ways) {
    return within_limits(staircase(name, ways, rest, hold, rest), law.model, reach.limits);
  };
  const auto fit = run("law-fit", levels), judge = run("law-judge", back);
  if (!fit || !judge || fit->duration() > reach.longest) return std::nullopt;
  return LawExperiment{law.text.in_words(), over, std::move(places), *fit, *judge};
}

}  // namespace emtb
