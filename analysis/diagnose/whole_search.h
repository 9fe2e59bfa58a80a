#pragma once

#include <cstddef>
#include <functional>
#include <optional>

#include "analysis/diagnose/criterion.h"
#include "analysis/diagnose/fitted_trials.h"
#include "analysis/diagnose/search.h"
#include "analysis/record/dataset.h"

namespace emtb {

/// A search on recorded runs from the beginning to its answer. A measured torque of which the model as given says
/// nothing has its law asked first; where it has none it is an input, and from there on no model is compared with it.
class WholeSearch {
 public:
  /// What a search asks once it has found an effect that removes most: do the runs tell another timing or other starts
  /// beside it? It gives the model as given, fitted to what has changed, and the search begins anew from there.
  using Resettle = std::function<std::optional<Trial>(const Model& with_the_effect)>;

  struct Options {
    std::size_t longest_list = 0;    ///< no more effects than this are named
    bool torque_only_loads = false;  ///< see torque_only_loads()
  };

  /// @param progress may be empty
  /// All but the options and the progress are borrowed.
  WholeSearch(Dataset& data, FittedTrials& trials, const Criterion& criterion, const Options& options,
              Search::Progress progress);

  /// @param first the model as given, once fitted; fitted again where the torque is left out
  Finding from(Trial& first, const Resettle& resettle = {});

  /// What was found, in data whose timing has changed slightly: without what stood in for that.
  Finding again(Finding found, const Loss& as_given);

  /// What was found, of which a member has gone since, with what ties with each that stayed.
  Finding with_rivals_renewed(Finding found, const Loss& as_given);

  /// Goes on with what was found, in which something is left. What its model withholds is not added.
  Finding gone_on(Finding found, const Loss& as_given);

  /// In data whose timing or starts have changed: what was found before, where it leaves nothing and no other effect
  /// does as well in the place of one of it; otherwise a search anew, unless what was found still does better.
  Finding anew_from(Trial& first, Finding before);

  /// The same model, fitted to data that have changed.
  Trial again(const Trial& fitted);

  FittedTrials& trials() { return trials_; }
  bool has_room(const Finding& found) const { return found.effects.size() < options_.longest_list; }
  bool torque_left_out() const { return torque_left_out_; }
  bool torque_has_a_law() const { return options_.torque_only_loads && !torque_left_out_; }

 private:
  Finding search(const Trial& start, const Loss& as_given);
  Finding search(const Trial& start);
  Finding search_and_settle(const Trial& first, const Resettle& resettle);
  bool spoils_the_motion(const Trial& with_law, const Trial& without) const;
  Finding with_the_motion(Finding law, const Trial& first);
  struct Law {
    Trial without;
    Finding found;
  };
  std::optional<Law> law_of(const Model& open);
  bool may_have_a_law(const Model& open);
  std::optional<Finding> law_beside(const Model& fitted, const Trial& first);

  Dataset& data_;
  FittedTrials& trials_;
  const Criterion& criterion_;
  Options options_;
  Search::Progress progress_;
  bool torque_left_out_ = false;
};

}  // namespace emtb
