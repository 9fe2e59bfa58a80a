#include "analysis/diagnose/tied_values.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace emtb {
namespace {

bool is_free(const Parameter& p) { return !p.fixed && !p.pinned; }

/// The value that a rival's fit found for a parameter of a model; none where it lacks it or has not fitted it.
std::optional<double> value_in(const Model& rival, const std::string& name) {
  const std::vector<std::string> names = rival.names();
  const auto found = std::ranges::find(names, name);
  if (found == names.end()) return std::nullopt;
  const Parameter& p = rival.at(static_cast<std::size_t>(found - names.begin()));
  return is_free(p) ? std::optional(p.value) : std::nullopt;
}

}  // namespace

void widen_by_ties(std::span<const Model> rivals, Model& fitted) {
  const std::vector<std::string> names = fitted.names();
  for (std::size_t i = 0; i < names.size(); ++i) {
    Parameter& p = fitted.at(i);
    if (!p.std_error || !is_free(p)) continue;
    double squares = 0, alike = 1;
    for (const Model& rival : rivals) {
      const std::optional<double> other = value_in(rival, names[i]);
      if (!other) continue;
      squares += (*other - p.value) * (*other - p.value);
      ++alike;
    }
    p.std_error = std::sqrt(*p.std_error * *p.std_error + squares / alike);
  }
}

std::vector<OtherValue> values_that_differ(const Model& fitted, const Model& rival, std::size_t effect) {
  constexpr double errors = 2, share = 0.01;
  std::vector<OtherValue> all;
  const std::vector<std::string> names = fitted.names();
  for (std::size_t i = 0; i < ModelStructure::base_count; ++i) {
    const Parameter& p = fitted.at(i);
    const std::optional<double> other = is_free(p) ? value_in(rival, names[i]) : std::nullopt;
    if (!other || !p.std_error) continue;
    const double apart = std::abs(*other - p.value);
    if (apart > errors * *p.std_error && apart > share * std::abs(p.value)) all.push_back({effect, names[i], *other});
  }
  return all;
}

}  // namespace emtb
