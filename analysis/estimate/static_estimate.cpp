#include "analysis/estimate/static_estimate.h"

#include <algorithm>

#include "hal/error.h"

namespace emtb {

bool StaticEstimate::has(const std::string& symbol) const {
  return std::ranges::find(quantities, symbol, &Quantity::symbol) != quantities.end();
}

const Quantity& StaticEstimate::at(const std::string& symbol) const {
  const auto found = std::ranges::find(quantities, symbol, &Quantity::symbol);
  if (found == quantities.end()) {
    throw SessionError(method + " gives no " + symbol + (lacking.empty() ? "" : ": " + lacking));
  }
  return *found;
}

}  // namespace emtb
