#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "analysis/diagnose/criterion.h"
#include "analysis/diagnose/score.h"
#include "analysis/diagnose/trials.h"
#include "model/model.h"

namespace emtb {

/// The effects of the library and the formulas on offer that a model neither includes nor withholds.
std::vector<std::size_t> absent_effects(const Model& model);

/// Friction that falls with speed is a part of dry friction: without that it makes no sense.
bool makes_sense(std::size_t effect, const Model& model);

/// The model without those of its effects that go.
Model without(Model model, bool (*goes)(const EffectInfo&));

/// Has an effect any size in a fitted model? Not where each rests where the effect is absent.
bool has_size(std::size_t effect, const Model& model);

/// What is left with an effect; none where the fit does without it: another refit of the rest says nothing of it.
std::optional<double> error_with(const Addition& a);

/// Does some effect of the model need this one?
bool needed(std::size_t effect, const Model& model);

/// Which of the effects found is of the same family as this one, if any? What holds the current back is of that of the
/// driver's edges where nobody reads the terminals: each has the transients of the other.
std::optional<std::size_t> same_family_as(std::size_t effect, const std::vector<std::size_t>& found,
                                          const Trial& fitted);

/// Does an effect say how late an edge or a reading comes? Such effects stand in for each other, and a score at nothing
/// may not tell: a resistance that has bent to a lag leaves no room for an inductance.
bool says_how_late(std::size_t effect);

/// Does one model do better than another, more than a tie, and foretell nothing clearly worse?
bool does_better(const Criterion& criterion, const Loss& other, const Loss& current);

/// Is a model with another effect in the place of a member tied with it? Not where it needs more parameters for that,
/// and its likelihood does not pay for them.
bool does_as_well(const Criterion& criterion, const Trial& current, std::size_t member, const Trial& other,
                  std::size_t in_its_place);

/// A model with each of the amplitudes of an effect held at nothing in turn, where it has several: what it may not
/// need.
std::vector<Model> with_fewer_amplitudes(const Model& fitted, std::size_t effect);

/// The effects of the library that repeat several times a turn, as far as a model does not include them.
std::vector<std::size_t> absent_waves(const Model& model);

/// The scored effects that are worth a refit, best first. @param at_most so many
std::vector<Score> worth_a_refit(const std::vector<Score>& scores, const Model& fitted, std::size_t at_most,
                                 const ScoreOptions& options);

/// All scored effects that make sense. Each is begun also at larger sizes than its score expects, from where the data
/// would show it clearly to where it would no longer be that effect: a descent from nothing may find no way.
std::vector<Score> from_clear_sizes_too(const std::vector<Score>& scores, const Model& fitted,
                                        const FittedMachine& machine);

/// The scored effects that are worth trying two at a time, best first.
std::vector<Score> worth_pairing(const std::vector<Score>& scores, const Trial& fitted,
                                 const std::vector<std::size_t>& added, const ScoreOptions& options);

/// The first steps, other than that with `begun_with`, that came near the best: what a search passed by.
/// @param cost of the model without them
std::vector<const Addition*> near_the_best(const std::vector<Addition>& refits, double cost,
                                           std::optional<std::size_t> begun_with);

/// The fit, as one whose rotor phases hold with an effect more or less; null where they do not.
const Trial* known_for(std::size_t effect, const Trial& fit);

}  // namespace emtb
