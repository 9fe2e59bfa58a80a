#include "analysis/diagnose/refit.h"
#include "analysis/fit/calibrate.h"
#include "hal/error.h"
#include "model/catalogue.h"
#include "report/text.h"
#include "tools/page/numbers.h"
#include "tools/page/work.h"

namespace emtb::page {

/// A formula is fitted beside the parameters of the model, in few steps: to see at once what it is worth.
json Work::score_formula(const json& formula) const {
  refuse_unless_fit_for_fitting();
  const Model offered = with_formula(formula);
  CalibrationOptions quick;
  quick.extra_starts = 0;
  quick.max_iterations = 20;
  quick.quick_errors = true;
  const Fit before = fit_or_none(data_.train, offered, quick);
  if (!std::isfinite(before.cost)) throw Error("the model cannot be simulated as it stands: it leaves all bounds");
  const Fit begun = begun_refit_with(data_.train, before, effect_count);  // the first that is on offer
  if (!std::isfinite(begun.cost)) throw Error("the model cannot be simulated with this formula: it leaves all bounds");
  const Calibration after = calibrate(data_.train, begun.model, quick);
  const auto errors = [&](std::span<const Record> records) {
    return json{{"before", number(error_on(records, before.model))}, {"after", number(error_on(records, after.model))}};
  };
  json out{{"train", errors(data_.train)}, {"held_out", errors(data_.held_out)}, {"parameters", json::object()}};
  for (const Parameter& p : after.model.terms.back().parameters) {
    out["parameters"][p.symbol] = {{"value", number(p.value)},
                                   {"std_error", p.std_error ? number(*p.std_error) : json(nullptr)},
                                   {"unit", p.unit}};
  }
  const bool worse = error_on(data_.train, after.model) > 0.99 * error_on(data_.train, before.model);
  out["text"] = worse ? "It explains nothing of what the model leaves." : "Fitted to the training runs in few steps.";
  return out;
}

}  // namespace emtb::page
