#include "tools/effect_picture.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "analysis/diagnose/overlay.h"
#include "analysis/fit/calibrate.h"
#include "analysis/record/dataset.h"
#include "hal/error.h"
#include "model/catalogue.h"
#include "report/symbols.h"
#include "tools/prediction.h"

namespace emtb {
namespace {

constexpr double rate = 500;         // [Hz] of the run
constexpr double instrument = 1e-4;  // of the largest reading: what it is weighed by. There is no noise
constexpr double shown_from = 3e-5;  // of the largest reading

/// Puts an effect in at the size that is typical of it.
void include_typical(Model& model, std::size_t effect) {
  model.include(effect);
  const EffectInfo& about = model.about(effect);
  std::vector<Parameter>& parameters = model.parameters_of(effect);
  for (std::size_t i = 0; i < about.parameter_count; ++i) parameters[i].value = about.parameter_list[i].typical;
}

double largest(const std::vector<double>& values) {
  double most = 0;
  for (const double v : values) most = std::max(most, std::abs(v));
  return most;
}

}  // namespace

NamedFigure effect_picture(std::size_t effect, const Model& model, const Profile& profile) {
  Model lacking = model, having = model;
  const EffectInfo& about = model.about(effect);
  if (!about.needs.empty()) {
    for (Model* m : {&lacking, &having}) include_typical(*m, effect_index(about.needs));
  }
  include_typical(having, effect);
  Run run = prediction(having, profile, rate).runs.front();
  for (const Signal unread : {Signal::theta, Signal::torque}) run.signals.erase(unread);
  for (const auto& [signal, series] : run.signals)
    lacking.noise[signal] = instrument * std::max(1e-3, largest(series.value));
  const Dataset data = prepare(std::span(&run, 1), {}, lacking);
  const Model fitted = calibrate(std::span<const Record>(data.train), lacking).model;
  const std::vector<Overlay> all = overlays(data.train.front(), fitted);

  const std::string id(about.id);
  Figure figure(std::string(about.name), "What " + id + " leaves of a model that lacks it.");
  figure.wide(600).x({.label = "time", .unit = "s", .min = 0});
  const auto speed = std::ranges::find(all, Signal::omega, &Overlay::signal);
  if (speed != all.end()) {
    figure.panel({symbol_of(Signal::omega), "rad/s"}, 110)
        .line("with it", speed->t, speed->measured, {Ink::grey, 2.5, Dash::solid})
        .line("fitted without", speed->t, speed->simulated, {Ink::blue, 1.5, Dash::solid});
  }
  bool any = false;
  for (const Overlay& o : all) {
    const std::vector<double> residual = o.residual();
    if (largest(residual) < shown_from * largest(o.measured)) continue;
    any = true;
    figure.panel({"residual of " + symbol_of(o.signal), printed_unit(info(o.signal).unit)}, 70)
        .line("", o.t, residual, {Ink::vermilion, 1, Dash::solid})
        .reference(0, "", {Ink::grey, 0.7, Dash::solid});
  }
  if (!any)
    throw ModelError("a run of " + profile.name() + " shows nothing of " + id + ": " + std::string(about.shows));
  return {id, std::move(figure), std::string(about.shows)};
}

}  // namespace emtb
