#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "analysis/check/check.h"
#include "analysis/numerics/statistics.h"
#include "config/mapping.h"
#include "config/model.h"
#include "figures/terminal.h"
#include "hal/error.h"
#include "report/findings.h"
#include "report/result_json.h"
#include "report/text.h"
#include "session/spec.h"
#include "tools/checked.h"
#include "tools/commands.h"

namespace emtb {
namespace {

struct CheckOptions {
  std::string map, model, json_file;
  std::vector<std::string> sessions, held_out;

  std::vector<Run> runs(const std::vector<std::string>& specs) const {
    return read_runs(specs, map.empty() ? Mapping{} : read_mapping(map));
  }
};

int check_command(const CheckOptions& o) {
  const std::vector<Run> train = o.runs(o.sessions), held_out = o.runs(o.held_out);
  DataFindings findings;
  if (o.model.empty()) {
    findings = check(train, held_out);
  } else {
    const Model model = read_model(o.model);
    findings = check(train, held_out, &model);
  }
  write_json(o.json_file, to_json(findings));
  if (o.json_file != "-") {
    for (const std::string& line : lines_of(findings)) std::cout << fitted(line, width_of_rows());
    const auto runs = train.size() + held_out.size();
    if (findings.empty()) std::cout << "nothing is wrong with " << runs << (runs == 1 ? " run\n" : " runs\n");
  }
  return stops(findings) ? 1 : 0;
}

}  // namespace

void refuse_slow_readings(std::span<const Run> runs) {
  constexpr double slowest = 5;  // [s] between readings; a motor's time constants are fractions of a second
  for (const Run& run : runs) {
    double fastest = std::numeric_limits<double>::infinity();
    for (const auto& [signal, series] : run.signals) {
      if (fastest <= slowest) break;  // one that is read often enough will do
      std::vector<double> intervals;
      for (std::size_t k = 1; k < series.t.size(); ++k) intervals.push_back(series.t[k] - series.t[k - 1]);
      if (!intervals.empty()) fastest = std::min(fastest, median(std::move(intervals)));  // whatever gaps there are
    }
    if (!std::isfinite(fastest) || fastest <= slowest) continue;
    throw Error(run.name + ": its readings are " + pretty(fastest, 3) +
                " s apart, too far to see a motor turn. If its times are in ms, say so: --map FILE with time_unit: ms");
  }
}

DiagnoseOptions SearchWords::options() const {
  if (!(effort > 0)) throw Error("--effort takes a factor above 0: 1 is some minutes, 10 ten times as much");
  DiagnoseOptions options;
  options.explain_torque = !explain.empty();
  options.effort = effort;
  return options;
}

bool may_be_fitted(std::span<const Run> train, std::span<const Run> held_out, const Model& model, bool unchecked,
                   std::ostream& say) {
  if (unchecked) return true;
  const DataFindings findings = check(train, held_out, &model);
  for (const std::string& line : lines_of(findings)) say << fitted(line, width_of_rows());
  if (!stops(findings)) return true;
  say << fitted("Nothing was fitted: " + why_nothing_is_fitted(findings), width_of_rows());
  return false;
}

void add_check_command(CommandLine& line, const std::shared_ptr<const KeptAnswers>& answers) {
  const auto o = std::make_shared<CheckOptions>();
  line.command("check", "looks whether recordings are what they say: scale, sign, clipping, holds, spikes, gaps, twins")
      .arguments("SESSION", o->sessions, "PATH[#RUN][@T0:T1], .csv, .h5 or .mat")
      .options("--held-out", o->held_out, "sessions that will judge a fit: none of them may be among the others")
      .option("--map", o->map, "how the columns of foreign CSV files become signals")
      .option("--model", o->model, "a model's YAML, whose bounds say what scales are possible")
      .option("--json", o->json_file, "writes the findings to this file; - for standard output")
      .action([o, answers] {
        return answers->answer(
            {files_read({o->model, o->map}, o->sessions, o->held_out), files_written({o->json_file})},
            [&] { return check_command(*o); });
      });
}

}  // namespace emtb
