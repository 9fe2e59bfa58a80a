#include "analysis/check/sampling.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "analysis/check/readings.h"
#include "analysis/numerics/statistics.h"
#include "session/gaps.h"

namespace emtb {
namespace {

std::vector<double> all_times(const Run& run) {
  std::vector<double> t;
  for (const auto& [signal, series] : run.signals) {
    std::vector<double> joined;
    std::ranges::set_union(t, series.t, std::back_inserter(joined));
    t = std::move(joined);
  }
  return t;
}

DataFinding gap_finding(const Run& run, std::optional<Signal> signal, const std::vector<Gap>& found) {
  const Gap longest = *std::ranges::max_element(found, {}, [](const Gap& g) { return g.to - g.from; });
  const std::string who = signal ? name_of(*signal) : "the file";
  std::string text = who + " has no reading for " + short_number(longest.to - longest.from) + " s";
  if (found.size() > 1) text += ", the longest of " + std::to_string(found.size()) + " gaps";
  text += signal
              ? ": what is compared leaves it out"
              : ": the run is taken as " + std::to_string(found.size() + 1) + " pieces, each with a start of its own";
  return {run.name, signal, Flaw::gap, longest.from, longest.to, text, false};
}

std::optional<DataFinding> uneven_rows(const Run& run, std::span<const double> t) {
  if (t.size() < 20) return std::nullopt;
  std::vector<double> intervals;
  for (std::size_t k = 1; k < t.size(); ++k) intervals.push_back(t[k] - t[k - 1]);
  const double usual = median(intervals);
  const auto count = static_cast<double>(intervals.size());
  const auto off = static_cast<double>(
      std::ranges::count_if(intervals, [&](double i) { return std::abs(i - usual) > 0.5 * usual; }));
  if (off <= 0.1 * count) return std::nullopt;
  return DataFinding{run.name,
                     {},
                     Flaw::jitter,
                     t.front(),
                     t.back(),
                     short_number(100 * off / count) +
                         " % of the rows come more than half an interval early or late (usually " +
                         short_number(usual) + " s apart): stamp readings when they are taken, not when they arrive",
                     false};
}

}  // namespace

DataFindings sampling_flaws(const Run& run) {
  DataFindings findings;
  const std::vector<double> t = all_times(run);
  const std::vector<Gap> holes = gaps(t);
  if (!holes.empty()) findings.push_back(gap_finding(run, {}, holes));
  for (const auto& [signal, series] : run.signals) {
    std::vector<Gap> own = is_sparse(run, signal) ? std::vector<Gap>{} : gaps(series.t);
    std::erase_if(own, [&](const Gap& g) {
      return std::ranges::any_of(holes, [&](const Gap& h) { return g.from <= h.to && h.from <= g.to; });
    });
    if (!own.empty()) findings.push_back(gap_finding(run, signal, own));
  }

  for (const auto& [signal, series] : run.signals) {
    if (is_sparse(run, signal)) continue;
    if (auto uneven = uneven_rows(run, series.t)) {
      findings.push_back(*uneven);
      break;  // the rows of one file
    }
  }
  return findings;
}

}  // namespace emtb
