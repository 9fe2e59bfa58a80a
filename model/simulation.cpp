#include "model/simulation_loop.h"

namespace emtb {

template void simulate<double>(const ModelStructure&, std::span<const double>, const Excitation&, Reader<double>&,
                               const Variation&);
template void simulate<Sensitive>(const ModelStructure&, std::span<const Sensitive>, const Excitation&,
                                  Reader<Sensitive>&, const Variation&);
template void simulate<WideSensitive>(const ModelStructure&, std::span<const WideSensitive>, const Excitation&,
                                      Reader<WideSensitive>&, const Variation&);

}  // namespace emtb
