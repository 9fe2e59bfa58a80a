#include <memory>

#include "model/catalogue.h"
#include "tools/checked.h"
#include "tools/commands.h"
#include "tools/model/model_options.h"
#include "tools/search_options.h"

namespace emtb {

void add_model_commands(CommandLine& line, const std::shared_ptr<const KeptAnswers>& answers) {
  const auto o = std::make_shared<ModelOptions>();
  const auto on_files = [&](Command command) {
    command.argument("MODEL", o->model, "the model's YAML")
        .arguments("SESSION", o->sessions,
                   "PATH[#RUN][@T0:T1], .csv, .h5 or .mat: what the model is fitted to or compared with")
        .options("--held-out", o->held_out, "sessions that judge the fit and take no part in it")
        .option("--map", o->map, "how the columns of foreign CSV files become signals")
        .option("--out", o->out, "writes the resulting model here; a MODEL is never overwritten otherwise")
        .option("--json", o->json_file, "writes the result to this file; - for standard output")
        .options("--outputs", o->outputs, "fits to these signals alone: omega, i_a, e_a, torque")
        .offers(signal_names);
    return command;
  };
  const auto with_intervals = [&](Command command) {
    return command.flag("--intervals", o->intervals,
                        "95 % intervals by profile likelihood: right also at a bound and where effects are not linear");
  };
  const auto looking_first = [&](Command command) { return command.flag("--unchecked", o->unchecked, unchecked_help); };
  const auto act = [&](int (*command)(const ModelOptions&)) {
    return [o, answers, command] { return answers->answer(o->files(), [&] { return command(*o); }); };
  };
  looking_first(with_intervals(on_files(
                    line.command("calibrate", "fits the free parameters of a model to sessions, within their bounds"))))
      .action(act(calibrate_command));
  on_files(
      line.command(
          "compare",
          "compares a model with measurements and shows where it fails; or several: compare A.yaml B.yaml SESSION..."))
      .flag("--fit", o->fit, "fits the model to the sessions first")
      .flag("--plot", o->plot, "draws the signal that is furthest off, also where the output is no terminal")
      .action(act(compare_command));
  Command diagnose = looking_first(
      with_intervals(on_files(line.command("diagnose", "finds out which physical effect a model is missing"))));
  search_options(diagnose, o->candidates, o->wanted, o->search)
      .flag("--all", o->every_candidate, "shows every candidate, not only the best five")
      .action(act(diagnose_command));
  Command add = line.command("add", "adds an effect to a model, fits it, and shows what it brought");
  add.argument("EFFECT", o->effect, "its id: see emtb effects; or that of a formula in --candidates")
      .offers(effect_ids);
  looking_first(with_intervals(on_files(add)))
      .option("--candidates", o->candidates, candidates_help)
      .action(act(add_command));
}

}  // namespace emtb
