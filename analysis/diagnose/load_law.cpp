#include "analysis/diagnose/load_law.h"

#include <algorithm>
#include <array>

namespace emtb {
namespace {

/// Withholds those effects of which `left_alone` holds, beside those that were withheld.
template <class LeftAlone>
void withhold(Model& model, LeftAlone left_alone) {
  for (std::size_t effect = 0; effect < model.known_effects(); ++effect) {
    if (!model.withholds(effect) && left_alone(model.about(effect))) model.withheld.push_back(effect);
  }
}

/// Does a model follow the torque to within a tenth of how much it varies?
bool follows_the_torque(const Loss& held_out) {
  const Materiality rule;
  return !remainder_in(held_out, Signal::torque, rule) || held_out.share_left(Signal::torque) <= rule.far_off;
}

}  // namespace

bool torque_loads_the_shaft(const Dataset& data) { return std::ranges::any_of(data.train, &Record::measured_load); }

bool concerns_the_load(const EffectInfo& effect) {
  return effect.stage == Stage::load || effect.reads == Signal::torque;
}

std::optional<Finding> law_of_the_load(const Trial& fitted, const std::function<Finding(const Trial&)>& search) {
  Trial start = fitted;
  withhold(start.fit.model, [](const EffectInfo& effect) { return !concerns_the_load(effect); });
  Finding law = search(start);
  law.current.fit.model.withheld = fitted.model().withheld;
  if (!follows_the_torque(law.current.held_out)) return std::nullopt;
  return law;
}

Trial without_effects_of_the_load(Trial fitted) {
  withhold(fitted.fit.model, concerns_the_load);
  return fitted;
}

Finding with_law(Finding law, Finding found) {
  const auto prepend = [](auto& all, auto first) {
    first.insert(first.end(), std::make_move_iterator(all.begin()), std::make_move_iterator(all.end()));
    all = std::move(first);
  };
  found.before.merge(law.before);
  found.rivals.merge(law.rivals);
  if (!found.steps.empty() && !law.steps.empty())
    found.steps.erase(found.steps.begin());  // the fit that both begin with
  prepend(found.effects, std::move(law.effects));
  prepend(found.candidates, std::move(law.candidates));
  prepend(found.steps, std::move(law.steps));
  return found;
}

void leave_out(Dataset& data, Signal signal) {
  for (std::vector<Record>* const records : std::array{&data.train, &data.held_out}) {
    for (Record& record : *records) {
      std::erase_if(record.observations, [signal](const Observation& o) { return o.signal == signal; });
    }
  }
}

}  // namespace emtb
