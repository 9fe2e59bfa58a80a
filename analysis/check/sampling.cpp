#include "analysis/check/sampling.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "analysis/check/readings.h"
#include "analysis/numerics/even_series.h"
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
  constexpr double a_good_part = 0.5, many = 0.1;  // of the usual interval; of the rows
  if (t.size() < 20) return std::nullopt;
  std::vector<double> intervals;
  for (std::size_t k = 1; k < t.size(); ++k) intervals.push_back(t[k] - t[k - 1]);
  const double usual = median(intervals);
  const auto share_off = [&](double from, double by) {
    const auto is_off = [&](double interval) { return std::abs(interval - from) > by; };
    return static_cast<double>(std::ranges::count_if(intervals, is_off)) / static_cast<double>(intervals.size());
  };
  const double off = share_off(usual, a_good_part * usual);
  if (off <= many) return std::nullopt;
  const double mean = mean_interval(t), digit = last_digit_of(t);
  // Even rows are never off by more than a digit that was left out.
  if (share_off(mean, (1 + 1e-6) * digit) <= many) {
    return DataFinding{run.name,
                       {},
                       Flaw::jitter,
                       t.front(),
                       t.back(),
                       "the times are whole steps of " + short_number(digit) + " s, and the rows " +
                           short_number(mean) + " s apart: write times with more digits",
                       false};
  }
  return DataFinding{run.name,
                     {},
                     Flaw::jitter,
                     t.front(),
                     t.back(),
                     short_number(100 * off) +
                         " % of the rows come more than half an interval early or late (usually " +
                         short_number(usual) + " s apart): stamp readings when they are taken, not when they arrive",
                     false};
}

/// Rows that come several at a time, a tenth of the usual interval apart or less, in which the shaft turns as far as in
/// others: they were written down together, and stamped then.
std::optional<DataFinding> stamped_on_arrival(const Run& run) {
  constexpr double at_once = 0.1;  // of the mean interval
  constexpr double many = 0.3;     // of the rows, and of what the shaft turns
  constexpr double clear = 2;      // steps of the encoder
  if (!run.has(Signal::theta)) return std::nullopt;
  const Series& theta = run.at(Signal::theta);
  const std::size_t n = theta.t.size();
  if (n < 20) return std::nullopt;
  const double mean = (theta.t.back() - theta.t.front()) / static_cast<double>(n - 1), step = step_of(theta);
  double quick = 0, turned = 0, turned_quickly = 0;
  for (std::size_t k = 1; k < n; ++k) {
    const bool is_quick = theta.t[k] - theta.t[k - 1] < at_once * mean;
    const double turns = std::abs(theta.value[k] - theta.value[k - 1]);
    quick += is_quick ? 1 : 0;
    if (turns <= clear * step) continue;
    turned += turns;
    turned_quickly += is_quick ? turns : 0;
  }
  if (quick < many * static_cast<double>(n) || !(turned > 0) || turned_quickly < many * turned) return std::nullopt;
  return DataFinding{run.name,
                     Signal::theta,
                     Flaw::jitter,
                     theta.t.front(),
                     theta.t.back(),
                     short_number(100 * quick / static_cast<double>(n - 1)) +
                         " % of the rows come at once with the one before, though theta goes on in them as in others: "
                         "they bear the time at which they were written. Give that at which they were read; were they "
                         "even, a row would take " +
                         short_number(mean) + " s",
                     true};
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

  if (auto at_once = stamped_on_arrival(run)) {
    findings.push_back(std::move(*at_once));
    return findings;
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
