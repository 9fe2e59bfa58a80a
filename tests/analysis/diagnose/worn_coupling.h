#pragma once

#include <span>

#include "model/catalogue.h"
#include "tests/blind/recording.h"

namespace emtb {

/// A bench whose coupling has a spring [N m/rad] and a play [rad]; its model knows the spring, about, and lacks the
/// play.
/// @param known k, d and J_2 of the model
inline blind::Bench worn_coupling(double stiffness, double gap, std::span<const double, 3> known) {
  blind::Bench worn = blind::fast_bench();
  auto& shaft = worn.plant.shaft;
  shaft.stiffness = stiffness;
  shaft.damping = 2e-4;  // [N m s/rad]
  shaft.J_2 = 2e-5;      // [kg m2]
  shaft.gap = gap;
  const std::size_t compliance = effect_index("shaft_compliance");
  worn.model.include(compliance);
  std::vector<Parameter>& coupling = worn.model.parameters_of(compliance);
  for (std::size_t i = 0; i < known.size(); ++i) coupling[i].value = known[i];
  return worn;
}

}  // namespace emtb
