#include "analysis/diagnose/finding.h"

#include <utility>

namespace emtb {

void Finding::add(std::size_t effect, Trial with) {
  before.insert_or_assign(effect, current.held_out);
  effects.push_back(effect);
  current = std::move(with);
  steps.push_back(
      {"added " + std::string(current.model().about(effect).id), effect, current.train, current.held_out_error()});
}

}  // namespace emtb
