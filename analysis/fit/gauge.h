#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "analysis/record/record.h"
#include "model/model.h"

namespace emtb {

/// What data cannot tell of a model, and the parameters that are held for it.
///
/// The speed and the voltage of a motor tell how much faster it turns with more voltage, and how long it takes. R_a, J
/// and all torques share a factor that they leave free: a motor of twice the resistance, half the inertia and half the
/// friction moves alike. A fit with all of them free wanders along this valley until it meets a bound, and then rests
/// there with values that mean nothing and standard errors as wide as the valley. So one parameter of each such null
/// direction is held, *pinned*, at what the model file says of it. All others are then as well determined as the data
/// allow, and the ratios that do not contain the pin, T_c/J say, are the same wherever it lies.
///
/// A null direction is one along which the parameters may change by more than a factor of ten, as the singular values
/// of the scaled sensitivities foretell. A prior counts as the reading that it is; bounds do not: they tell nothing,
/// they only end the valley.

/// How a parameter goes with one that is held: as its power, where the slope of the valley is one.
struct Follower {
  std::string parameter;
  double power = 0;  ///< d ln(parameter)/d ln(pin) along the valley; -1: as the reciprocal
};

/// A parameter that is held because the data cannot tell it.
struct Pin {
  std::size_t place = 0;  ///< in the structure
  std::string parameter;  ///< `R_a`
  double value = 0;       ///< at which it is held
  std::string unit;
  std::vector<Follower>
      followers;              ///< whose values are right only as far as the pin's is; empty: the runs do not see it
  bool current_read = false;  ///< the armature current was measured, or drives the model
};

/// The places of the parameters to hold, of those that a fitted model has free; empty where the data tell them all.
/// First B where it only adds to what K_b does; then R_a, which is the easiest to measure, K_m, J, K_b; then those of
/// effects. So the rest is determined, and none of it needs to change its sign or to leave zero wherever the pin lies.
std::vector<std::size_t> places_to_hold(std::span<const Record> records, const Model& fitted);

/// Is a parameter told by itself, but not beside the others: a factor that the data leave free carries it along?
bool carried_along(std::span<const Record> records, const Model& fitted, std::size_t place);

/// The model as given with those parameters held: B at nothing, the others at the values given, or where the rest would
/// have to leave its bounds for that, as near to them as loses nothing.
/// @param fitted the same model fitted with all of them free
Model hold(std::span<const Record> records, const Model& given, const Model& fitted,
           std::span<const std::size_t> places);

/// A fitted model whose pins lie where the model as given was pinned, with those that may now lie nearer to what is
/// known moved there: what a model lacks bends its valley, and an effect straightens it. None where all stay.
/// @param given without pins, for the values given
std::optional<Model> held_nearer(std::span<const Record> records, const Model& given, const Model& fitted);

/// The same model with all pins free again.
Model without_pins(Model model);

/// Do the data tell a free parameter, to less than a third of its size? As standard errors have it that hold for
/// coloured residuals: by those for white ones, any effect that explains a little of a large remainder seems to tell
/// all.
bool told(std::span<const Record> records, const Model& fitted, std::size_t place);

/// The same model with those pins free that its effects let the data tell; none where all stay.
std::optional<Model> with_told_pins_free(std::span<const Record> records, const Model& fitted);

/// The same model with those parameters held, where they are, that its effects leave untold, as many as are held; none
/// where they are the same. A B that adds to K_b is told beside a friction, and what was told without it may share a
/// factor now.
std::optional<Model> with_pins_elsewhere(std::span<const Record> records, const Model& fitted);

/// The pins of a fitted model, and what goes with each.
std::vector<Pin> pins_of(std::span<const Record> records, const Model& fitted);

/// The standard errors of what goes with a B that is held, widened by what B may really be, from nothing to three times
/// of what the model file has: K_b stands for both, say, and is known no better than B is.
/// @param given with the value of B that the file says
void widen_by_held_damping(std::span<const Record> records, const Model& given, Model& fitted);

/// The parameters held with which the value of this one goes.
std::vector<std::string> scaled_with(std::span<const Pin> pins, const std::string& parameter);

}  // namespace emtb
