#include "analysis/check/beyond_driver.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "analysis/check/readings.h"

namespace emtb {

DataFindings beyond_driver(std::span<const Run> runs, const Model& model) {
  constexpr double far = 2;  // times the limit: drivers are set a little short of what they are asked for
  const DriverModel driver = model.driver.value_or(DriverModel{});
  if (driver.supply() >= DriverModel::unlimited) return {};
  DataFindings findings;
  for (const Run& run : runs) {
    if (!run.has(Signal::u_ref)) continue;
    const Series& u_ref = run.at(Signal::u_ref);
    const auto asked = [&](double u) { return std::abs(driver.gain * u); };
    const auto most = std::ranges::max_element(u_ref.value, {}, asked);
    if (most == u_ref.value.end() || !(asked(*most) > far * driver.supply())) continue;
    const auto is_beyond = [&](double u) { return asked(u) > far * driver.supply(); };
    const auto first = std::ranges::find_if(u_ref.value, is_beyond);
    findings.push_back({run.name, Signal::u_ref, Flaw::scale,
                        u_ref.t[static_cast<std::size_t>(first - u_ref.value.begin())], run.duration(),
                        name_of(Signal::u_ref) + " asks for " + short_number(asked(*most)) +
                            " V, where the model's driver ends at " + short_number(driver.supply()) +
                            " V: is it in another unit, or a code that means something else, as a brake? Leave such "
                            "rows out, or mend the map or the model's driver",
                        false, true});
  }
  return findings;
}

}  // namespace emtb
