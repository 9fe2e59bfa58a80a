#include "tools/model/model_options.h"

#include <iostream>

#include "config/formula_effect.h"
#include "config/mapping.h"
#include "config/model.h"
#include "hal/error.h"
#include "session/gaps.h"
#include "session/spec.h"
#include "tools/checked.h"

namespace emtb {

std::vector<Run> ModelOptions::runs(const std::vector<std::string>& specs) const {
  auto all = read_runs(specs, map.empty() ? Mapping{} : read_mapping(map));
  refuse_slow_readings(all);
  return all;
}

KeptAnswers::Files ModelOptions::files() const {
  return {files_read({model, map, candidates}, sessions, held_out), files_written({json_file, out})};
}

std::optional<CheckedRuns> ModelOptions::checked_runs(const Model& m) const {
  const CheckedRuns given{runs(sessions), runs(held_out)};
  if (!may_be_fitted(given.train, given.held_out, m, unchecked, json_file == "-" ? std::cerr : std::cout)) return {};
  return CheckedRuns{split_at_gaps(given.train, m.input), split_at_gaps(given.held_out, m.input)};
}

Model ModelOptions::model_with_candidates() const {
  Model m = read_model(model);
  if (!candidates.empty()) offer(m, candidates);
  return m;
}

CalibrationOptions ModelOptions::calibration() const {
  CalibrationOptions options;
  for (const std::string& name : outputs) {
    const auto signal = signal_named(name);
    if (!signal) throw Error("--outputs " + name + ": no such signal. Known: omega, i_a, e_a, torque");
    options.outputs.push_back(*signal);
  }
  return options;
}

void ModelOptions::finish_model(const Model& made) const {
  if (out.empty()) return;
  write_model(out, made);
  std::cout << "written: " << out << "\n";
}

}  // namespace emtb
