#include "analysis/check/check.h"

#include <algorithm>
#include <iterator>

#include "analysis/check/angle_leaps.h"
#include "analysis/check/angle_speed.h"
#include "analysis/check/balance.h"
#include "analysis/check/begins_anew.h"
#include "analysis/check/between_runs.h"
#include "analysis/check/beyond_driver.h"
#include "analysis/check/clipped.h"
#include "analysis/check/dead_reference.h"
#include "analysis/check/duplicate.h"
#include "analysis/check/held.h"
#include "analysis/check/leaps.h"
#include "analysis/check/lost_sign.h"
#include "analysis/check/power.h"
#include "analysis/check/resting.h"
#include "analysis/check/sampling.h"
#include "analysis/check/scale.h"
#include "analysis/check/spikes.h"
#include "analysis/check/stops_dead.h"
#include "analysis/check/swapped.h"
#include "analysis/numerics/parallel.h"

namespace emtb {
namespace {

void add(DataFindings& to, DataFindings more) { std::ranges::move(more, std::back_inserter(to)); }

/// What a run says by itself.
struct Looked {
  DataFindings findings;
  MotionWindows windows;
};

Looked look_at(const Run& run) {
  Looked l;
  DataFindings sampling, spiked, leapt, cut, stays, turned;
  at_once([&] { sampling = sampling_flaws(run); }, [&] { spiked = spikes(run); }, [&] { leapt = leaps(run); },
          [&] { cut = clipped(run); }, [&] { stays = held(run); }, [&] { turned = angle_against_speed(run); },
          [&] { l.windows = motion_windows(run); });
  add(l.findings, std::move(sampling));
  const bool speed_is_spiked =
      std::ranges::any_of(spiked, [](const DataFinding& f) { return f.signal == Signal::omega; });
  add(l.findings, std::move(spiked));
  if (!speed_is_spiked) add(l.findings, std::move(leapt));  // they may be the same readings
  std::erase_if(cut, [&](const DataFinding& f) {            // a value held at the extreme is not cut off
    return std::ranges::any_of(stays, [&](const DataFinding& h) {
      return h.stops && h.signal == f.signal && h.from <= f.to && f.from <= h.to;
    });
  });
  add(l.findings, std::move(cut));
  const auto of_the_angle = [](const DataFinding& f) { return f.signal == Signal::theta; };
  if (std::ranges::none_of(stays, of_the_angle) && std::ranges::none_of(l.findings, of_the_angle))
    add(l.findings, angle_leaps(run));  // else it may be the end of that
  add(l.findings, std::move(stays));
  add(l.findings, std::move(turned));
  const bool told = std::ranges::any_of(l.findings, [](const DataFinding& f) { return f.what == Flaw::sign; });
  const MotorBalance balance = balance_of(l.windows);
  if (!told) add(l.findings, turned_signs(l.windows, balance, run.name, run.duration()));
  if (!stops(l.findings)) add(l.findings, swapped(l.windows, balance, run.name, run.duration()));
  add(l.findings, stops_dead(run));
  add(l.findings, drive_without_sign(l.windows, run.name, run.duration()));
  return l;
}

}  // namespace

DataFindings check(std::span<const Run> train, std::span<const Run> held_out, const Model* model) {
  std::vector<Run> runs(train.begin(), train.end());
  runs.insert(runs.end(), held_out.begin(), held_out.end());
  std::vector<Looked> looked(runs.size());
  each_on_a_core(runs.size(), [&](std::size_t r) { looked[r] = look_at(runs[r]); });

  DataFindings findings;
  MotionWindows windows;
  std::vector<MotionWindows> of_each;
  for (Looked& l : looked) {
    append(windows, l.windows);
    of_each.push_back(std::move(l.windows));
    add(findings, std::move(l.findings));
  }
  add(findings, duplicates(train, held_out));
  add(findings, resting(runs));
  add(findings, dead_reference(runs));
  add(findings, begins_anew(runs));
  const MotorBalance together = balance_of(windows);
  if (!stops(findings)) add(findings, swapped(windows, together, {}, 0));  // several runs tell more
  if (!stops(findings)) add(findings, scales_between_runs(runs, of_each));
  const bool sign_known =
      std::ranges::none_of(findings, [](const DataFinding& f) { return f.what == Flaw::sign && f.stops; });
  const bool scale_known = std::ranges::none_of(findings, [](const DataFinding& f) { return f.what == Flaw::scale; });
  if (sign_known) add(findings, turned_signs(windows, together, {}, 0));
  if (sign_known && scale_known) {
    DataFindings scales = wrong_scales(windows, together, model);
    if (scales.empty() && !model && !stops(findings)) scales = unfixed_scale(windows, together);
    add(findings, std::move(scales));
  }
  if (model != nullptr) add(findings, beyond_driver(runs, *model));
  return findings;
}

bool stops(const DataFindings& findings) { return std::ranges::any_of(findings, &DataFinding::stops); }

}  // namespace emtb
