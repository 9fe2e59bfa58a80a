#include "model/simulation_loop.h"

namespace emtb {

template void simulate<double>(const ModelStructure&, std::span<const double>, const Excitation&, Trajectory<double>&);
template void simulate<Sensitive>(const ModelStructure&, std::span<const Sensitive>, const Excitation&,
                                  Trajectory<Sensitive>&);

}  // namespace emtb
