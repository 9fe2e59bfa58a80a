#pragma once

#include <cstddef>
#include <vector>

#include "analysis/live/change.h"

namespace emtb {

/// When a change is told: how long a motor is learnt, how long a suspicion has to stand, how long the size of a change
/// is followed once it is told. Counts half-seconds in which the motor turned.
class ChangeWatch {
 public:
  static constexpr std::size_t learn = 20;           ///< half-seconds before which nothing is a change
  static constexpr std::size_t looked_through = 20;  ///< the last ones, in which a change is looked for
  static constexpr std::size_t follow = 30;          ///< for which the size of a change is followed

  /// What is to be done after a look.
  enum class Then {
    wait,         ///< nothing
    learn,        ///< the motor is as it was: what it showed is taken in
    begin_again,  ///< the motor was not known yet: what it showed is worth nothing
    tell          ///< a change
  };

  /// What was seen so far is of no more use.
  void forget() {
    seen_ = since_change_ = 0;
    score_ = 0;
    looks_ = 0;
  }

  /// It is learnt anew, with the estimator's values, what the motor is.
  void learn_anew() { known_ = false; }

  /// The values changed much.
  void restart_learning() { taught_ = 0; }

  void see() { ++seen_; }
  std::size_t seen() const { return seen_; }
  bool half_learnt() const { return seen_ >= learn / 2; }
  bool learnt() const { return seen_ >= learn; }

  /// No change is followed, and the motor is not known yet: it is the estimator that knows better.
  bool takes_values() const { return !known_ && since_change_ == 0; }
  bool following() const { return since_change_ > 0; }
  bool watching() const { return learnt() && !following(); }

  /// So many of the last half-seconds can be looked at, as far as what came before them tells enough.
  bool may_look(std::size_t last) const { return last + learn / 2 <= seen_; }

  /// @param highest score of all looks. @param best that of the change that explains most
  Then look(double highest, double best);
  double score() const { return score_; }
  bool doubtful() const;

  /// A change of the last so many half-seconds is told.
  void tell(LiveChange change, std::size_t half_seconds);

  /// A half-second more since then. @return so many in all
  std::size_t follow_on() { return ++since_change_; }
  /// The change, as it is seen by now.
  void correct(double score, const LiveChange& change);
  bool followed() const { return since_change_ >= follow; }
  std::size_t since_change() const { return since_change_; }

  /// A half-second is over. @return from now on the motor counts as known
  bool becomes_known();
  /// Before any change all that there is tells what the motor is; after one, what came since.
  bool first_motor() const { return changes_.empty(); }

  const std::vector<LiveChange>& changes() const { return changes_; }
  /// Told since the last call.
  std::vector<LiveChange> news();

 private:
  bool known_ = false;            ///< the motor: the estimator's values are no longer taken
  std::size_t taught_ = 0;        ///< half-seconds since the estimator's values were last far from these
  std::size_t seen_ = 0;          ///< half-seconds
  double score_ = 0;              ///< standard errors
  int looks_ = 0;                 ///< for which a suspicion has stood
  std::size_t since_change_ = 0;  ///< half-seconds since the change that is followed; 0: none is
  std::vector<LiveChange> changes_, news_;
};

}  // namespace emtb
