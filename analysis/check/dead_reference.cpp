#include "analysis/check/dead_reference.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "analysis/check/readings.h"

namespace emtb {
namespace {

bool is_zero(const Series& series) {
  return !series.value.empty() && std::ranges::all_of(series.value, [](double v) { return v == 0; });
}

/// The means of a signal over equal parts of a run's time; those without a reading are as the part before.
std::vector<double> means_of(const Series& y, double from, double to) {
  constexpr std::size_t parts = 50;
  std::vector<double> sum(parts, 0), count(parts, 0), means;
  for (std::size_t k = 0; k < y.t.size(); ++k) {
    const double place = (y.t[k] - from) / (to - from) * static_cast<double>(parts);
    if (!(place >= 0) || !std::isfinite(y.value[k])) continue;
    const std::size_t part = std::min(parts - 1, static_cast<std::size_t>(place));
    sum[part] += y.value[k];
    ++count[part];
  }
  for (std::size_t i = 0; i < parts; ++i) {
    means.push_back(count[i] > 0 ? sum[i] / count[i] : means.empty() ? 0 : means.back());
  }
  return means;
}

/// Whether the size of a signal grows by a clear share of its largest: a motor that coasts or is braked only loses.
bool grows(const std::vector<double>& means) {
  constexpr double clear = 0.3;
  double least = std::numeric_limits<double>::infinity(), most = 0, growth = 0;
  for (const double mean : means) {
    least = std::min(least, std::abs(mean));
    most = std::max(most, std::abs(mean));
    growth = std::max(growth, std::abs(mean) - least);
  }
  return growth > clear * most;
}

/// Whether power goes into the armature: its circuit is closed, and what is told of it grows and drives.
bool is_driven(const Run& run) {
  if (run.has(Signal::armature_open) && !is_zero(run.at(Signal::armature_open))) return false;
  const Series& u_ref = run.at(Signal::u_ref);
  const double from = u_ref.t.front(), to = u_ref.t.back();
  if (!(to > from)) return false;
  const auto means = [&](Signal signal) -> std::optional<std::vector<double>> {
    if (!run.has(signal) || run.at(signal).value.size() < 20 || !moves(run.at(signal))) return std::nullopt;
    return means_of(run.at(signal), from, to);
  };
  const auto e_a = means(Signal::e_a), i_a = means(Signal::i_a), omega = means(Signal::omega);
  if (run.has(Signal::i_a) && !i_a) return false;  // another one turns it
  const auto& with_i_a = e_a ? e_a : omega;        // of the same sign where it drives
  if (i_a && with_i_a) {
    double power = 0;
    for (std::size_t k = 0; k < i_a->size(); ++k) power += (*i_a)[k] * (*with_i_a)[k];
    if (!(power > 0)) return false;
  }
  return e_a ? grows(*e_a) : i_a && omega && grows(*omega);
}

}  // namespace

DataFindings dead_reference(std::span<const Run> runs) {
  bool driven = false;
  for (const Run& run : runs) {
    if (!run.has(Signal::u_ref)) continue;
    if (!is_zero(run.at(Signal::u_ref))) return {};
    driven = driven || is_driven(run);
  }
  if (!driven) return {};
  return {{{},
           Signal::u_ref,
           Flaw::rest,
           0,
           0,
           name_of(Signal::u_ref) +
               " is exactly 0 in all runs though something drives the motor: is it wired? A model from the reference "
               "needs it; for one from e_a leave the column out",
           false}};
}

}  // namespace emtb
