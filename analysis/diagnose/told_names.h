#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>

#include "analysis/diagnose/criterion.h"
#include "analysis/diagnose/roads.h"
#include "analysis/diagnose/whole_search.h"
#include "analysis/fit/calibrate.h"
#include "analysis/record/dataset.h"
#include "hal/signal.h"

namespace emtb {

/// What makes a remainder worth a name, as for worth_a_name().
struct WorthAName {
  std::span<const Signal> inputs;
  const Materiality& rule;
};

/// A search from the beginning, of the runs as they were recorded, that leaves out these effects as well.
using SearchWithout = std::function<Road(std::span<const std::size_t> effects)>;

/// Of what a search found, keeps what the errors that are printed tell from nothing. What goes may have stood where
/// something else belongs, and may have told a timing: where something is left without it, all is searched anew without
/// what had a value that it cannot have, or goes on without what was not told. That answer stands where it leaves
/// clearly less.
/// @return what is known of the errors of the rest; none where it has no fit
std::optional<Calibration> keep_what_is_told(Road& road, const SearchWithout& without, WholeSearch& search,
                                             const Criterion& criterion, Dataset& data, const WorthAName& worth);

}  // namespace emtb
