#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "config/formula_effect.h"
#include "config/mapping.h"
#include "config/model.h"
#include "hal/error.h"
#include "report/discovery_json.h"
#include "report/progress.h"
#include "report/report_page.h"
#include "report/result_json.h"
#include "report/text.h"
#include "tools/checked.h"
#include "tools/commands.h"
#include "tools/discover_rest.h"
#include "tools/search_options.h"

namespace emtb {
namespace {

using json = nlohmann::ordered_json;

struct ReportOptions {
  std::string model, map, candidates, out = "report.html", png, json_file, command;
  std::vector<std::string> sessions, held_out;
  Wanted wanted;
  SearchWords search;
  bool unchecked = false;
};

/// Each figure as DIR/NAME.png; a name that is taken gets a number.
class Pictures {
 public:
  explicit Pictures(std::string folder) : folder_(std::move(folder)) {
    std::error_code error;
    std::filesystem::create_directories(folder_, error);
    if (error) throw Error(folder_ + ": cannot be made (" + error.message() + "). Give another --png DIR");
  }

  void write(const NamedFigure& named) {
    const int times = ++taken_[named.name];
    const std::string name = named.name + (times > 1 ? "_" + std::to_string(times) : "");
    write_png(named.figure, std::filesystem::path(folder_) / (name + ".png"));
  }

 private:
  std::string folder_;
  std::map<std::string, int> taken_;
};

int report_command(const ReportOptions& o) {
  const Mapping mapping = o.map.empty() ? Mapping{} : read_mapping(o.map);
  ReportInput in = ReportInput::of(o.model, read_model(o.model), o.command);
  in.map_file = o.map;
  in.candidates_file = o.candidates;
  if (!o.candidates.empty()) offer(in.model, o.candidates);
  withhold_unwanted(in.model, o.wanted);
  for (const bool held_out : {false, true}) {
    for (const std::string& spec : held_out ? o.held_out : o.sessions) in.add(spec, held_out, mapping);
  }
  if (!o.png.empty()) {
    in.on_figure = [pictures = std::make_shared<Pictures>(o.png)](const NamedFigure& named) { pictures->write(named); };
  }
  DiagnoseOptions options = o.search.options();
  // What is printed for people must not mix with JSON on standard output.
  std::ostream& say = o.json_file == "-" ? std::cerr : std::cout;

  if (!may_be_fitted(in.part(false), in.part(true), in.model, o.unchecked, say)) return 1;
  in.split_at_gaps();

  Progress progress;
  Diagnosis d;
  try {
    options.progress = [&](double share, const std::string& doing) { progress.show(0.9 * share, doing); };
    d = diagnose(in.part(false), in.part(true), in.model, options);
  } catch (const ModelError& refusal) {
    progress.clear();
    write_page(o.out, refusal_page(in, refusal.what()));
    write_json(o.json_file, json{{"verdict", nullptr}, {"refused", refusal.what()}});
    std::cerr << "emtb: " << refusal.what() << "\n";
    say << "written, with the recordings as they are: " << o.out << "\n";
    return 1;
  }
  for (const Step& s : d.steps) d.final.history.push_back({s.action, s.train, s.held_out, o.sessions});
  progress.show(0.9, "looking into what is left");
  const std::unique_ptr<Discovery> rest = discover_rest(d, in.part(false), in.part(true));
  in.discovery = rest.get();
  progress.show(0.92, "drawing");
  write_page(o.out, report_page(in, d));
  progress.clear();
  json result = to_json(d);
  if (rest) result["discovered"] = to_json(*rest);
  write_json(o.json_file, result);
  say << "written: " << o.out << " (" << word(d.verdict) << ")\n";
  return 0;
}

}  // namespace

void add_report_command(CommandLine& line, int argc, const char* const* argv) {
  const auto o = std::make_shared<ReportOptions>();
  o->command = as_called(argc, argv);
  Command report = line.command("report", "diagnoses a model and writes all of it as one HTML page, with figures");
  report.argument("MODEL", o->model, "the model's YAML")
      .arguments("SESSION", o->sessions, "PATH[#RUN][@T0:T1], .csv, .h5 or .mat: what the model is fitted to")
      .options("--held-out", o->held_out, "sessions that judge the fit and take no part in it")
      .option("--map", o->map, "how the columns of foreign CSV files become signals");
  search_options(report, o->candidates, o->wanted, o->search)
      .option("--out", o->out, "the page [report.html]")
      .option("--png", o->png, "writes each figure as PNG into this folder, too")
      .option("--json", o->json_file, "writes the diagnosis to this file; - for standard output")
      .flag("--unchecked", o->unchecked, unchecked_help)
      .action([o] { return report_command(*o); });
}

}  // namespace emtb
