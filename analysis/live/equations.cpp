#include "analysis/live/equations.h"

#include <cstddef>

namespace emtb {

LiveEquations LiveEquations::zero(Eigen::Index unknowns) {
  return {Eigen::MatrixXd::Zero(unknowns, unknowns), Eigen::VectorXd::Zero(unknowns)};
}

void LiveEquations::add(std::span<const LagSums> outputs, std::span<const NoiseColour> colours) {
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    if (outputs[o].blocks() > 0) outputs[o].weigh_into(h, g, colours[o]);
  }
}

LiveEquations& LiveEquations::operator+=(const LiveEquations& other) {
  h += other.h;
  g += other.g;
  return *this;
}

}  // namespace emtb
