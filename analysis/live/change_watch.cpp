#include "analysis/live/change_watch.h"

#include <utility>

#include "analysis/live/change_test.h"

namespace emtb {
namespace {

// By hand, on the two simulated benches (docs/decisions/live-estimates.md).
constexpr std::size_t known_after = 60;  ///< half-seconds, after which the estimator's values are no longer waited for
constexpr int alarm_looks = 5;           ///< for which a suspicion stands until it is told
constexpr std::size_t most_told = 8;     ///< changes that are kept

}  // namespace

bool ChangeWatch::doubtful() const { return !(score_ < change_at::doubtful); }

ChangeWatch::Then ChangeWatch::look(double highest, double best) {
  score_ = highest;
  looks_ = best >= change_at::alarm ? looks_ + 1 : 0;
  if (looks_ > 0 && (!known_ || seen_ < known_after)) return Then::begin_again;
  if (looks_ >= alarm_looks) return Then::tell;
  return known_ && !doubtful() ? Then::learn : Then::wait;
}

void ChangeWatch::tell(LiveChange change, std::size_t half_seconds) {
  looks_ = 0;
  since_change_ = half_seconds;
  if (changes_.size() == most_told) changes_.erase(changes_.begin());
  changes_.push_back(std::move(change));
  news_.push_back(changes_.back());
}

void ChangeWatch::correct(double score, const LiveChange& change) {
  score_ = score;
  if (score < change_at::alarm) return;
  const double noticed = changes_.back().noticed;
  changes_.back() = change;
  changes_.back().noticed = noticed;
}

bool ChangeWatch::becomes_known() {
  ++taught_;
  if (known_ || (first_motor() ? taught_ : seen_) < known_after || doubtful()) return false;
  known_ = true;
  return true;
}

std::vector<LiveChange> ChangeWatch::news() { return std::exchange(news_, {}); }

}  // namespace emtb
