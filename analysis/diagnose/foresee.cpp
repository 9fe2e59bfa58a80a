#include "analysis/diagnose/foresee.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "hal/error.h"

namespace emtb {
namespace {

constexpr double longest_step = 1e-3;     // [s] of a simulation whose peaks count
constexpr double smallest_share = 0.1;    // of the levels: with less, an experiment shows little
constexpr double coarse_interval = 0.01;  // [s] of a run that lasts minutes

/// The largest share of any limit that a run takes.
double share_taken(const Foreseen& run, const SignalLimits& limits) {
  double share = 0;
  for (const auto& [signal, limit] : limits) {
    for (const double value : run.readings.of(signal)) share = std::max(share, std::abs(value) / limit);
  }
  return share;
}

Profile scaled(const Profile& profile, double by) {
  std::vector<Knot> knots(profile.knots().begin(), profile.knots().end());
  for (Knot& knot : knots) knot.value *= by;
  return {profile.name(), std::move(knots)};
}

}  // namespace

std::optional<Foreseen> foresee(const Model& model, const Profile& profile, double interval) {
  if (model.input != Signal::u_ref) {
    throw ModelError("model `" + model.name + "` is driven by " + std::string(info(model.input).name) +
                     ": a profile is a driver reference, u_ref");
  }
  Foreseen run;
  Excitation& x = run.excitation;
  const auto n = static_cast<std::size_t>(std::floor(profile.duration() / interval)) + 1;
  for (std::size_t k = 0; k < n; ++k) {
    x.t.push_back(static_cast<double>(k) * interval);
    x.u_ref.push_back(profile.reference(x.t.back()));
  }
  x.longest_step = longest_step;
  const std::vector<double> values = model.values();
  simulate<double>(model.structure(), values, x, run.readings);
  if (!std::ranges::all_of(run.readings.omega, [](double w) { return std::isfinite(w); })) return std::nullopt;
  return run;
}

std::optional<Profile> within_limits(const Profile& profile, const Model& model, const SignalLimits& limits,
                                     double share) {
  if (limits.empty()) return profile;
  const double interval = profile.duration() > 100 ? coarse_interval : longest_step;
  double size = 1;
  while (size >= smallest_share) {
    const Profile smaller = size == 1 ? profile : scaled(profile, size);
    const std::optional<Foreseen> run = foresee(model, smaller, interval);
    if (!run) return std::nullopt;
    const double taken = share_taken(*run, limits);
    if (taken <= share) return smaller;
    size *= std::min(0.95, share / taken);
  }
  return std::nullopt;
}

}  // namespace emtb
