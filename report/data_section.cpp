#include "report/data_section.h"

#include <algorithm>
#include <map>
#include <set>

#include "config/model.h"
#include "figures/number.h"
#include "report/figures_of_diagnosis.h"
#include "report/rest_words.h"
#include "report/sha256.h"
#include "report/symbols.h"
#include "report/words.h"
#include "session/spec.h"

namespace emtb {
namespace {

/// What each signal would give, for those that a run lacks.
struct Use {
  Signal signal;
  const char* gives;
};
constexpr Use uses[] = {
    {Signal::u_ref, "the driver's input: without it nothing is known of the driver"},
    {Signal::e_a,
     "tells whether the driver or the motor fails; without it R_{a} and the driver's own resistance are one"},
    {Signal::i_a,
     "separates R_{a} from K_{b} and what the motor takes from what the shaft loses; a multimeter will do"},
    {Signal::omega, "the speed, which most of the model is about; an encoder angle does as well"},
    {Signal::torque,
     "sets the scale of K_{m}, B, J and the frictions, and tells load from friction; the load must vary"},
    {Signal::temperature, "shows whether R_{a} warms up during a run"}};

/// What became of a signal's readings, in words; their number left out is added to `left_out`.
std::string fate_of(const ReportRun& r, Signal signal, const Record& record, const Model& model,
                    std::size_t& left_out) {
  const Observation* observed = record.find(signal);
  if (signal == model.input) return "drives the model";
  if (signal == Signal::armature_open) return "opens the armature circuit of the model";
  if (observed != nullptr) {
    left_out += r.run.at(signal).t.size() - observed->size();
    if (signal == Signal::e_a && record.measured_voltage)
      return "compared with the driver's model, and drives the motor";
    if (signal == Signal::torque && record.measured_load) return "compared with the model, and loads the shaft";
    if (signal == Signal::torque) return "compared with the model; it reads zero, so that it loads nothing";
    return "compared with the model";
  }
  if (signal == Signal::theta && !r.run.has(Signal::omega)) return "its slope is the speed that is compared";
  return "recorded, but not used by this model";
}

/// Which readings there are, which were used, and for what.
void readings_tables(Page& page, const ReportInput& in, const Dataset& data) {
  std::set<Signal> recorded;
  for (const ReportRun& r : in.runs)
    for (const auto& [signal, series] : r.run.signals) recorded.insert(signal);
  std::vector<std::string> heading{"run", "used for", "span [s]"};
  std::string columns = "lll";
  for (const Signal signal : recorded) heading.push_back(symbol_of(signal)), columns += 'r';
  std::vector<std::vector<std::string>> rows;
  std::map<Signal, std::vector<std::string>> fates;  // those that differ
  std::size_t train = 0, held = 0, left_out = 0;
  for (const ReportRun& r : in.runs) {
    const Record& record = r.held_out ? data.held_out[held++] : data.train[train++];
    rows.push_back(
        {short_name(r.whole.name), r.held_out ? "judging" : "fitting", printed(r.from) + " … " + printed(r.to)});
    for (const Signal signal : recorded) {
      if (!r.run.has(signal)) {
        rows.back().push_back("–");
        continue;
      }
      const std::size_t used = r.run.at(signal).t.size(), all = r.whole.at(signal).t.size();
      rows.back().push_back(std::to_string(used) + (used < all ? " of " + std::to_string(all) : ""));
      const std::string fate = fate_of(r, signal, record, in.model, left_out);
      if (std::ranges::find(fates[signal], fate) == fates[signal].end()) fates[signal].push_back(fate);
    }
  }
  page.table("Readings within the spans, and of how many in the file where there are more", columns, heading, rows);
  rows.clear();
  for (const auto& [signal, list] : fates) {
    rows.push_back({symbol_of(signal), std::string(info(signal).meaning), joined(list, "; elsewhere ")});
  }
  page.table("What became of them", "lll", {"signal", "meaning", "use"}, rows);
  page.paragraph(left_out == 0
                     ? "Every reading of the signals compared was used."
                     : std::to_string(left_out) +
                           " readings of the signals compared were not used: beyond the span of the input, or means "
                           "that began before it.");
}

}  // namespace

void signals_lacking(Page& page, const ReportInput& in) {
  std::vector<std::vector<std::string>> rows;
  for (const Use& use : uses) {
    if (use.signal == Signal::omega && in.every_run_has(Signal::theta)) continue;
    if (use.signal == Signal::u_ref && in.model.input != Signal::u_ref) continue;
    const bool electrical = use.signal == Signal::e_a || use.signal == Signal::temperature;
    if (electrical && in.model.input == Signal::i_a) continue;  // a current drive's voltage is its own matter
    if (in.every_run_has(use.signal)) continue;
    rows.push_back({symbol_of(use.signal) + " (`" + std::string(info(use.signal).column) + "`)",
                    in.some_run_has(use.signal) ? "in some runs" : "no", use.gives});
  }
  if (rows.empty()) return;
  page.table("Signals that these runs lack, and what each would give", "lll", {"signal", "recorded", "gives"}, rows);
}

void raw_figures(Page& page, const ReportInput& in, bool used) {
  std::vector<std::string> shown;
  for (const ReportRun& r : in.runs) {
    if (std::ranges::find(shown, r.whole.name) != shown.end()) continue;
    shown.push_back(r.whole.name);
    std::vector<UsedSpan> spans;
    bool part = false;
    for (const ReportRun& other : in.runs) {
      if (other.whole.name != r.whole.name) continue;
      spans.push_back({other.from, other.to, other.held_out ? "held out" : "training"});
      part = part || other.from > 0 || other.to < r.whole.duration();
    }
    NamedFigure figure = raw_figure(r.whole, spans);
    figure.caption = part   ? "As recorded, all of it. Shaded: the spans that were named."
                     : used ? "As recorded, all of it used."
                            : "As recorded.";
    page.figure(figure);
  }
}

void data_section(Page& page, const ReportInput& in, const Dataset& data) {
  page.section("Noise floor and data");
  std::vector<std::vector<std::string>> rows;
  for (const auto& [signal, noise] : data.noise) {
    rows.push_back({compared_symbol(signal), printed(noise.sigma, printed_unit(info(signal).unit), 3),
                    source_in_words(noise), autocorrelation_in_words(noise)});
  }
  page.table("Noise floor of each signal: the same for all models that are compared here", "lrlr",
             {"signal", "σ", "where it comes from", "autocorrelation"}, rows);
  page.paragraph(
      "Where the voltage moves fast or a measured input is noisy, a reading's σ is widened by what timing and that "
      "noise allow "
      "any model to know; the grey bands show it.");
  page.paragraph("Timing: " + in_words(data.timing, data.interval(), in.model) + ".");
  signals_lacking(page, in);
  page.fold("Which readings were used, and for what");
  readings_tables(page, in, data);
  page.end_fold().fold("All runs as recorded");
  raw_figures(page, in, true);
  page.end_fold();
}

void repeat_section(Page& page, const ReportInput& in, const Diagnosis* d) {
  page.section("To repeat this");
  page.paragraph(in.software + "; " + in.date + ". Called as").code(in.command);
  std::vector<std::vector<std::string>> rows;
  const auto add_file = [&](const std::string& file, const std::string& what) {
    if (std::ranges::any_of(rows, [&](const auto& row) { return row[0] == file; })) return;
    rows.push_back({file, what, std::to_string(std::filesystem::file_size(file)), "`" + sha256(file) + "`"});
  };
  add_file(in.model_file, "model");
  if (!in.candidates_file.empty()) add_file(in.candidates_file, "candidates");
  if (!in.map_file.empty()) add_file(in.map_file, "mapping");
  for (const ReportRun& r : in.runs) add_file(parse_session_spec(r.spec).path.string(), "session");
  page.table("Files read", "llrl", {"file", "what", "bytes", "SHA-256"}, rows);
  page.folded("The model as given", to_yaml(in.model));
  if (d == nullptr) return;
  page.folded("The base model: fitted to the training runs", to_yaml(d->base));
  if (!d->missing.empty()) page.folded("The final model", to_yaml(d->final));
}

}  // namespace emtb
