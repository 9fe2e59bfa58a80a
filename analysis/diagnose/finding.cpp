#include "analysis/diagnose/finding.h"

#include <cmath>
#include <utility>

namespace emtb {

std::vector<Step> Finding::steps_to_the_end() const {
  constexpr double hardly = 0.02;  // of the error
  const auto differ = [](double a, double b) { return std::abs(a - b) > hardly * b; };
  std::vector<Step> all = steps;
  if (all.empty()) return all;
  const Step& last = all.back();
  if (differ(last.train, current.train) || differ(last.held_out, current.held_out_error()))
    all.push_back({"timing and starts told anew", {}, current.train, current.held_out_error()});
  return all;
}

void Finding::add(std::size_t effect, Trial with) {
  before.insert_or_assign(effect, current.held_out);
  effects.push_back(effect);
  current = std::move(with);
  steps.push_back(
      {"added " + std::string(current.model().about(effect).id), effect, current.train, current.held_out_error()});
}

void Finding::swap(std::size_t place, std::size_t effect, Trial with) {
  const std::size_t member = effects[place];
  const auto id = [&](std::size_t of) { return std::string(with.model().about(of).id); };
  steps.push_back({"swapped " + id(member) + " for " + id(effect), effect, with.train, with.held_out_error()});
  before.insert_or_assign(effect, before.at(member));
  rivals.erase(member);
  near.erase(member);
  alike.erase(member);
  effects[place] = effect;
  current = std::move(with);
}

}  // namespace emtb
