#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "analysis/diagnose/criterion.h"
#include "analysis/diagnose/finding.h"
#include "analysis/diagnose/rounds.h"
#include "analysis/diagnose/trials.h"

namespace emtb {

/// The search for what a model is missing: forward, adding what removes most; cogging first, where a remainder is left;
/// fewer, where two may do what many were pieced together for; swaps; and without what became superfluous. Each is a
/// function of its own; what is tried, and how good it is, others say: moves.h proposes, Trials fits, Criterion
/// decides.
class Search {
 public:
  using Progress = std::function<void(double share, const std::string& doing)>;

  /// @param first the fit of the model that the search begins with
  /// @param as_given what the model as given leaves
  /// @param longest_list no more effects than this are added
  /// @param progress may be empty; shares only grow
  Search(Trials& trials, const Criterion& criterion, Trial first, Loss as_given, std::size_t longest_list,
         Progress progress = {});

  /// Goes on with what another search found, in data that have changed since.
  Search(Trials& trials, const Criterion& criterion, Finding found, Loss as_given, Progress progress = {});

  Finding run();

  /// The first effect added, which run() goes on from. @return the model with it; none where it does not remove most
  const Trial* first_step();

  /// What was found, and what removes something beside it or in the place of a part of it.
  /// @param longest_list no more effects than this in all
  Finding gone_on(std::size_t longest_list);

  /// What was found, fitted again, without what has become superfluous.
  Finding without_superfluous();

  /// What was found, of which a member has gone since, with what does as well in the place of each that stayed.
  Finding with_rivals_renewed();

  /// What was found, fitted again, with every other effect tried in the place of each.
  Finding held_against_others();

 private:
  /// What is found where cogging is taken first, and after it what removes most.
  struct Chain {
    std::vector<std::size_t> effects;
    std::map<std::size_t, Loss> before;
    Trial trial;
  };

  void forward();
  bool add_best(Round& round);
  bool add_best_of(std::vector<Addition> additions);
  bool add_pair(Round& round);
  bool add_what_the_scores_passed_by(Round& round);
  bool add_beside_what_is_alike();
  enum class PairExplains { most, all };  ///< of what is left
  bool add_two_in_turn(const Round& round, const std::vector<Addition>& first_steps,
                       PairExplains explains = PairExplains::most);
  void take(Pair two);
  void settle();
  void try_cogging_first();
  void try_fewer();
  void swap();
  void try_rivals_of(std::size_t place);
  std::vector<Rival> does_as_well_as(std::size_t place) const;
  Model with_another(std::size_t place, const Addition& alike) const;
  std::vector<Addition> alike_in_the_place_of(std::size_t place, const Round& reduced);
  bool try_in_the_place_of(std::size_t place, const Round& reduced, const std::vector<Addition>& refits);
  void try_all_in_the_place_of_each();
  void prune();
  void renew_rivals();
  Round* round_without(std::size_t place);
  void set_beside(std::size_t member, const Round& reduced, const Addition& a);
  bool is_rival(const Round& reduced, const Addition& a, std::size_t member);
  bool superfluous(std::size_t effect, std::optional<Trial>& without);

  bool told(const Trial& with, std::size_t effect, const Loss& without);
  std::optional<Addition> best_that_stays(std::vector<Addition>& additions, std::optional<Trial>& kept);
  const Addition* best_of(const std::vector<Addition>& additions, const Trial& current) const;
  std::optional<Chain> cogging_first(Round& bare, std::size_t most);
  std::optional<Pair> fewer(const Round& first, const Trial& many, std::size_t begun_with);
  std::optional<Trial> fit_without(std::size_t effect);
  bool mends_another(std::size_t effect, const std::vector<std::size_t>& others, const Loss& without,
                     const Loss& with) const;
  void remember(const Score& score, std::optional<double> held_out);
  void tell(double share, const std::string& doing);
  std::string id(std::size_t effect) const;

  Trials& trials_;
  const Criterion& criterion_;
  Loss as_given_;
  std::size_t longest_list_ = 0;  // what goes on adds nothing
  Progress progress_;
  double told_ = 0;  // the share
  Finding found_;
  std::set<std::size_t> dropped_;  // what others made superfluous is not added again
  bool rivals_are_stale_ = false;  // the members have changed since they were collected
  Rounds rounds_;
};

}  // namespace emtb
