#include "analysis/diagnose/compare.h"

#include <algorithm>
#include <cmath>

#include "analysis/fit/residuals.h"
#include "analysis/fit/starts.h"
#include "analysis/fit/timing.h"
#include "hal/error.h"

namespace emtb {

std::string_view name_of(Unit unit) noexcept {
  switch (unit) {
    case Unit::driver:
      return "driver";
    case Unit::motor:
      return "motor";
    case Unit::load:
      return "load";
  }
  return "motor";
}

std::map<Signal, SignalFit> fit_of(std::span<const Record> records, const Model& model, const Noise& noise) {
  struct Sums {
    double squares = 0, scaled = 0, value = 0, value_squares = 0, count = 0;
  };
  std::map<Signal, Sums> sums;
  for (const Residuals& r : residuals(records, model, model.values(), {})) {
    const Observation& o = *records[r.record].find(r.signal);
    Sums& s = sums[r.signal];
    for (std::size_t i = 0; i < o.size(); ++i) {
      const double scaled = r.value[static_cast<Eigen::Index>(i)];
      s.squares += std::pow(scaled * o.sigma[i], 2);
      s.scaled += scaled * scaled;
      s.value += o.value[i];
      s.value_squares += o.value[i] * o.value[i];
      s.count += 1;
    }
  }
  std::map<Signal, SignalFit> fits;
  for (const auto& [signal, s] : sums) {
    const double spread = s.value_squares - s.value * s.value / s.count;
    fits[signal] = {noise.at(signal), std::sqrt(s.squares / s.count), std::sqrt(s.scaled / s.count),
                    spread > 0 ? 100 * (1 - std::sqrt(s.squares / spread)) : 0};
  }
  return fits;
}

Comparison compare(std::span<const Run> runs, const Model& model, const Model& judge) {
  if (model.input != judge.input) {
    throw ModelError("models `" + judge.name + "` and `" + model.name + "` are driven by different inputs, " +
                     std::string(info(judge.input).name) + " and " + std::string(info(model.input).name) +
                     ": their errors cannot be compared");
  }
  Comparison result;
  Dataset staged = prepare(runs, {}, judge, Chaining::staged);
  settle_timing(staged, judge);
  settle_starts(staged, judge);
  const auto staged_squares = mean_squares(residuals(staged.train, model, model.values(), {}));
  result.error = error_of(staged_squares);
  result.signals = fit_of(staged.train, model, staged.noise);
  std::vector<Record> chained = prepare_with(staged.noise, runs, judge, Chaining::chained, staged.ripple_order);
  set_timing(chained, staged.timing);
  const auto chained_squares = mean_squares(residuals(chained, model, model.values(), {}));
  result.chained_error = error_of(chained_squares);
  for (const auto& [signal, square] : chained_squares) result.chained[signal] = std::sqrt(square);
  double worst = above_the_floor;
  for (const auto& [signal, square] : staged_squares) {
    if (std::sqrt(square) <= worst) continue;
    worst = std::sqrt(square);
    result.failing_unit = signal == Signal::e_a ? Unit::driver : signal == Signal::torque ? Unit::load : Unit::motor;
  }
  result.where = residual_maps(staged.train, model);
  return result;
}

}  // namespace emtb
