#include "analysis/check/beyond_driver.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "analysis/check/readings.h"

namespace emtb {

DataFindings beyond_driver(std::span<const Run> runs, const Model& model) {
  constexpr double far = 2;  // times the limit: drivers are set a little short of what they are asked for
  if (!model.driver || model.driver->supply() >= DriverModel::unlimited) return {};
  const double limit = model.driver->supply();
  const auto asked = [&](double u) { return std::abs(model.driver->gain * u); };
  DataFindings findings;
  for (const Run& run : runs) {
    if (!run.has(Signal::u_ref)) continue;
    const Series& u_ref = run.at(Signal::u_ref);
    const auto first = std::ranges::find_if(u_ref.value, [&](double u) { return asked(u) > far * limit; });
    if (first == u_ref.value.end()) continue;
    const double most = asked(std::ranges::max(u_ref.value, {}, asked));
    findings.push_back({run.name, Signal::u_ref, Flaw::scale,
                        u_ref.t[static_cast<std::size_t>(first - u_ref.value.begin())], run.duration(),
                        name_of(Signal::u_ref) + " asks for " + short_number(most) +
                            " V, where the model's driver ends at " + short_number(limit) +
                            " V: is it in another unit, or a code that means something else, as a brake? Leave such "
                            "rows out, or mend the map or the model's driver",
                        false, true});
  }
  return findings;
}

}  // namespace emtb
