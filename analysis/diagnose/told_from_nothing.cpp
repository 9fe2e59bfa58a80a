#include "analysis/diagnose/told_from_nothing.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "analysis/fit/gauge.h"
#include "model/catalogue.h"

namespace emtb {
namespace {

/// Is a limit told from the one that the driver is known to have? By itself and by what it is the inverse of: one that
/// is never reached is as good as any other.
bool told_from_known(const Parameter& found, double known, double errors) {
  if (!found.std_error) return false;
  const double error = errors * *found.std_error, v = found.value;
  return std::abs(v - known) > error && std::abs(1 / v - 1 / known) > error / (v * v);
}

/// The values at which an effect is absent from a model.
StartValues absent_at(std::size_t effect, const Model& model) {
  Ranges known;
  known.rise = model.structure().driver.rise;
  known.fall = model.structure().driver.fall;
  return starts_of(effect, known).front();
}

}  // namespace

bool told_from_zero(const Fit& judged, std::size_t effect, double errors) {
  const EffectInfo& about = judged.model.about(effect);
  const std::vector<Parameter>& included = judged.model.parameters_of(effect);
  bool any_amplitude = false, any_shape_told = false;
  for (std::size_t i = 0; i < about.parameter_count; ++i) {
    const EffectParameter& p = about.parameter_list[i];
    const Parameter& found = included[i];
    if (p.is_shape()) {
      any_shape_told = any_shape_told || (found.std_error && std::abs(found.value) > errors * *found.std_error);
      continue;
    }
    any_amplitude = true;
    if (found.value == p.null) continue;  // it rests where the effect is absent
    const bool on_bound = std::ranges::find(judged.at_bound, full_name(about, i)) != judged.at_bound.end();
    if (on_bound) return true;
    if (p.role == Role::limit) {
      if (told_from_known(found, absent_at(effect, judged.model)[i], errors)) return true;
      continue;
    }
    const double size = p.null == infinity ? found.value : found.value - p.null;
    if (found.std_error && std::abs(size) > errors * *found.std_error) return true;
  }
  // Of one that is there or not, one shape at least is told.
  return !any_amplitude && (about.has_no_size() || any_shape_told);
}

Fit with_standard_errors(std::span<const Record> records, const Model& fitted, bool quick) {
  CalibrationOptions as_it_is;
  as_it_is.extra_starts = as_it_is.max_iterations = 0;
  as_it_is.quick_errors = quick;
  return fit_or_none(records, fitted, as_it_is);
}

bool told_but_for_scale(std::span<const Record> records, const Fit& judged, std::size_t effect, double errors) {
  if (told_from_zero(judged, effect, errors)) return true;
  Model without = judged.model;
  without.exclude(effect);
  std::vector<std::size_t> places = places_to_hold(records, without);
  std::erase_if(places, [](std::size_t place) { return place >= ModelStructure::base_count; });
  if (places.empty()) return false;
  Model held = judged.model;
  for (const std::size_t place : places) held.at(place).fixed = true;
  return told_from_zero(with_standard_errors(records, held, true), effect, errors);
}

}  // namespace emtb
