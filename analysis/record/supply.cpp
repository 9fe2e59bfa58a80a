#include "analysis/record/supply.h"

#include <algorithm>
#include <cmath>

namespace emtb {

double supply_of(std::span<const Record> records, const Model& model) {
  const DriverModel& driver = model.structure().driver;
  if (driver.supply() < DriverModel::unlimited) return driver.supply();
  double most = 0;
  for (const Record& record : records) {
    for (const double u : record.excitation.u_ref) most = std::max(most, std::abs(driver.gain * u));
    for (const double e : record.excitation.e_a) most = std::max(most, std::abs(e));
  }
  return most;
}

Prior known_of_supply(std::span<const Record> records, const Model& model) {
  constexpr double sags = 0.2;  // of it; by hand
  const double supply = supply_of(records, model);
  return {supply, sags * supply};
}

}  // namespace emtb
