#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "analysis/diagnose/diagnose.h"
#include "analysis/diagnose/overlay.h"
#include "figures/figure.h"
#include "report/page.h"
#include "session/session.h"

namespace emtb {

/// Standard errors to each side of a value within which the truth is in 95 of 100 cases.
inline constexpr double normal_95 = 1.96;

/// The figures of a report, one function each.

/// One signal of a run: measured over the simulation of one or two models, the residuals below with the noise band.
/// @param run    what it is called in the title, e.g. `step_mid.h5, held out`
/// A signal of a run as both models have it, the residuals of both in one panel. @param before of the base model
NamedFigure hero_figure(const std::string& run, const Overlay& model, const std::optional<Overlay>& before);

/// @param before the base model, where another took its place
NamedFigure overlay_figure(const std::string& run, const Overlay& model, const std::optional<Overlay>& before = {});

/// The mean residual of a signal against each condition: small ones, to stand beside each other.
std::vector<NamedFigure> residual_map_figures(Signal signal, const Diagnosis& d);

/// Values with 95 % intervals of both models, in multiples of the final values.
NamedFigure parameter_figure(const Diagnosis& d);

/// How much each absent effect promised, and what it left on held-out runs once refitted.
NamedFigure promise_figure(const Diagnosis& d);
NamedFigure refit_figure(const Diagnosis& d);

/// The error from step to step.
NamedFigure staircase_figure(const Diagnosis& d);

/// What the equations lack, before and after; the curves must be of the same quantity against the same signal.
NamedFigure missing_figure(const MissingCurve& base, const std::optional<MissingCurve>& after);

/// Part of a recording, as it was used.
struct UsedSpan {
  double from = 0, to = 0;  ///< [s]
  std::string label;        ///< `training`
};

/// All signals of a run as recorded; the spans that were used are shaded where they are not the whole.
NamedFigure raw_figure(const Run& whole, std::span<const UsedSpan> spans);

/// The condition of a residual map as an axis.
Axis condition_axis(Condition against);

/// `base model`, `+ coulomb_friction`, `dropped windage`.
std::string step_name(const Step& step);

}  // namespace emtb
