#pragma once

#include "analysis/diagnose/search.h"
#include "analysis/diagnose/whole_search.h"
#include "analysis/fit/circumstances.h"
#include "analysis/record/dataset.h"

namespace emtb {

/// The model as given, and what a search found from there, under the same circumstances.
struct Road {
  Trial first;
  Finding found;
  Circumstances circumstances;
};

/// The timing that a model tells which lacks something may be what it lacks, and so hide it: the runs are searched as
/// they were recorded, too, where something is left; that answer stands where it leaves clearly less. What it finds
/// to lag by less than a row is then no matter of logging; a delay of less than a row always is.
///
/// Where the answer leaves far more of training runs than of held-out runs, all is searched once more with each
/// training run held out in turn, beside the held-out runs; that answer stands where it leaves clearly less of all, and
/// where held-out runs show what is left as well, most of it.
/// @param as_recorded the model as given, fitted to the data as they are
Road best_road(Dataset& data, WholeSearch& search, const Criterion& criterion, const Trial& as_recorded);

/// Parameters bend to the timing at which they are fitted, and may then tell that timing again: what was found is
/// fitted to the runs as they were recorded, and tells the timing from there. It is set where that leaves clearly less.
/// @return whether it was, and the answer is fitted anew
bool told_from_the_recorded(Dataset& data, WholeSearch& search, const Criterion& criterion, Trial& answer);

}  // namespace emtb
