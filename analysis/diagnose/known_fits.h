#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "analysis/fit/calibrate.h"
#include "analysis/record/record.h"
#include "model/model.h"

namespace emtb {

/// Where fits ended, by what they include: a descent that comes from elsewhere may end in another valley, and a search
/// would take back what it had found.
class KnownFits {
 public:
  /// The model of a fit that ended, in place of one with the same effects.
  void remember(const Model& fitted);

  /// The model of a fit, with the values that another of the same effects had, where they leave less; none where they
  /// do not. What somebody fixed stays.
  std::optional<Model> that_leaves_less(std::span<const Record> records, const Fit& fit) const;

 private:
  using Key = std::pair<std::vector<std::size_t>, std::vector<std::string>>;  ///< effects, all parameters
  static Key key_of(const Model& model);

  std::map<Key, std::vector<double>> values_;
};

}  // namespace emtb
