#include "session/gaps.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "session/spec.h"
#include "session/text.h"

namespace emtb {

std::vector<Gap> gaps(std::span<const double> t) {
  std::vector<Gap> found;
  if (t.size() < 20) return found;
  std::vector<double> intervals;
  for (std::size_t k = 1; k < t.size(); ++k) intervals.push_back(t[k] - t[k - 1]);
  const auto at = [&](double share) {
    const auto place =
        intervals.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(intervals.size() - 1));
    std::nth_element(intervals.begin(), place, intervals.end());
    return *place;
  };
  // A logger that hesitates with every hundredth row has no gaps; one that rests for a thousand rows has.
  const double usual = at(0.5);
  const double long_enough = std::min(std::max({10 * usual, 3 * at(0.99), 0.05}), std::max(1000 * usual, 1.0));
  for (std::size_t k = 1; k < t.size(); ++k) {
    if (t[k] - t[k - 1] > long_enough) found.push_back({t[k - 1], t[k]});
  }
  return found;
}

std::vector<Gap> spans_between_gaps(const Run& run, Signal input) {
  if (!run.has(input)) return {{0, HUGE_VAL}};
  const std::vector<double>& t = run.at(input).t;
  std::vector<Gap> spans;
  double from = 0;
  const auto close = [&](double to) {
    const auto readings = std::ranges::lower_bound(t, to) - std::ranges::lower_bound(t, from);
    if (readings >= 10) spans.push_back({from, to});
  };
  // Half open: the readings behind the gap belong to the next span, also those of signals that are read just before the
  // input. Half an interval does for them, to the microsecond.
  const double half = t.size() > 1 ? 0.5 * (t[1] - t[0]) : 0;
  for (const Gap& hole : gaps(t)) {
    const double end = std::round(1e6 * (hole.to - half)) / 1e6;
    close(end);
    from = end;
  }
  if (spans.empty() && from == 0) return {{0, HUGE_VAL}};
  close(HUGE_VAL);
  return spans;
}

std::vector<Run> split_at_gaps(const Run& run, Signal input) {
  const std::vector<Gap> spans = spans_between_gaps(run, input);
  if (spans.size() == 1 && spans[0].from == 0 && spans[0].to == HUGE_VAL) return {run};
  std::vector<Run> pieces;
  for (const Gap& span : spans) {
    Run piece = cut(run, span.from, span.to);
    const bool named_span = run.name.find('@') != std::string::npos;
    piece.name = run.name + (named_span ? ", " : "@") + (span.from > 0 ? shortest(span.from) : "") + ":" +
                 (std::isfinite(span.to) ? shortest(span.to) : "");
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

std::vector<Run> split_at_gaps(const std::vector<Run>& runs, Signal input) {
  std::vector<Run> all;
  for (const Run& run : runs) std::ranges::move(split_at_gaps(run, input), std::back_inserter(all));
  return all;
}

}  // namespace emtb
