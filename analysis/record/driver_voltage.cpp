#include "analysis/record/driver_voltage.h"

#include <cstddef>
#include <utility>

namespace emtb {

std::vector<double> driver_voltage(const Model& model, std::span<const double> values, const Excitation& x) {
  struct KeepVoltage final : Reader<double> {
    explicit KeepVoltage(std::size_t readings) : e_a(readings) {}
    void read(std::size_t k, const SimulatedReadings<double>& y) override { e_a[k] = y.e_a; }
    std::vector<double> e_a;
  } keep(x.t.size());
  simulate<double>(model.structure(), values, x, keep);
  return std::move(keep.e_a);
}

}  // namespace emtb
