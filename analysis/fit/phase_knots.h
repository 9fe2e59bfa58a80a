#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "analysis/fit/residuals.h"
#include "analysis/record/record.h"

namespace emtb {

/// Knots evenly spread over a run, and where each reading lies between them.
class Knots {
 public:
  Knots(const Record& record, std::size_t count);

  /// As many as an effect of an order needs: one where the wander puts it off by little in all of the run.
  static std::size_t wanted(const Record& record, double order);

  std::size_t count() const { return count_; }
  /// 1 / variance of the change from one knot to the next [1/rad^2].
  double stiffness() const { return stiffness_; }

  /// A time between the knots `knot` and `knot + 1`, nearer to the latter by `share`; a lone knot counts everywhere.
  struct Place {
    std::size_t knot = 0;
    double share = 0;
  };
  Place of(double t) const;
  std::vector<Place> of(const Residuals& r) const;  ///< of each reading, in the middle of its time

  /// Squares of the changes from knot to knot, in units of what is likely.
  double unlikely(std::span<const double> at) const;

 private:
  const Record& record_;
  std::size_t count_ = 1;
  double start_ = 0, interval_ = 0, stiffness_ = 0;
};

}  // namespace emtb
