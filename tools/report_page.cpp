#include "tools/report_page.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <ctime>
#include <fstream>
#include <map>
#include <set>

#include "config/model.h"
#include "emtb/version.h"
#include "figures/number.h"
#include "hal/error.h"
#include "model/catalogue.h"
#include "session/spec.h"
#include "tools/report_figures.h"
#include "tools/sha256.h"
#include "tools/symbols.h"
#include "tools/text.h"

namespace emtb {
namespace {

std::string with_space(const std::string& unit) { return unit.empty() ? "" : " " + unit; }

std::string value_of(const Parameter& p) {
  return (p.std_error ? printed(p.value, *p.std_error) : printed(p.value)) + with_space(printed_unit(p.unit));
}

std::string joined(const std::vector<std::string>& words, const std::string& last = " and ") {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == words.size() ? last : ", ") + words[i];
  }
  return text;
}

/// `Coulomb friction (T_c = 0.0547 ± 0.0003 N m)`
std::string in_words(const Diagnosis& d, const MissingEffect& m) {
  std::vector<std::string> values;
  for (const Parameter& p : m.parameters) values.push_back(symbol_of(p.symbol) + " = " + value_of(p));
  return std::string(d.about(m.effect).name) + (values.empty() ? "" : " (" + joined(values, ", ") + ")");
}

std::string judged_on(const Diagnosis& d) {
  return d.judged_on_training ? "the one run there is"
         : d.left_one_out     ? "runs held out in turn"
                              : "runs that no fit has seen";
}

std::string floors(double error) { return printed(error, 3) + " noise floors"; }

std::string fall(const Diagnosis& d) {
  return "from " + floors(d.base_held_out) + " to " + printed(d.final_held_out, 3);
}

std::string missing_in_words(const Diagnosis& d) {
  std::vector<std::string> list;
  for (const MissingEffect& m : d.missing) list.push_back(in_words(d, m));
  return joined(list);
}

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

bool every_run_has(const ReportInput& in, Signal signal) {
  return std::ranges::all_of(in.runs, [&](const ReportRun& r) { return r.run.has(signal); });
}
bool some_run_has(const ReportInput& in, Signal signal) {
  return std::ranges::any_of(in.runs, [&](const ReportRun& r) { return r.run.has(signal); });
}

void signals_lacking(Page& page, const ReportInput& in) {
  std::vector<std::vector<std::string>> rows;
  for (const Use& use : uses) {
    if (use.signal == Signal::omega && every_run_has(in, Signal::theta)) continue;
    if (use.signal == Signal::u_ref && in.model.input != Signal::u_ref) continue;
    const bool electrical = use.signal == Signal::e_a || use.signal == Signal::temperature;
    if (electrical && in.model.input == Signal::i_a) continue;  // a current drive's voltage is its own matter
    if (every_run_has(in, use.signal)) continue;
    rows.push_back({symbol_of(use.signal) + " (`" + std::string(info(use.signal).column) + "`)",
                    some_run_has(in, use.signal) ? "in some runs" : "no", use.gives});
  }
  if (rows.empty()) return;
  page.table("Signals that these runs lack, and what each would give", "lll", {"signal", "recorded", "gives"}, rows);
}

/// `-0.12 K_b +0.99 B` as printed, and a parameter on its own without its factor.
std::string combination(const Undetermined& u) {
  if (u.combination.starts_with("+1.00 ")) return symbol_of(u.combination.substr(6));
  std::string out;
  for (std::size_t i = 0; i < u.combination.size();) {
    const std::size_t end = std::min(u.combination.find(' ', i), u.combination.size());
    const std::string word = u.combination.substr(i, end - i);
    const bool number = word.find_first_of("0123456789") < 2;
    out += (out.empty() ? "" : " ") + (number ? with_minus(word) : symbol_of(word));
    i = end + 1;
  }
  return out;
}

std::string undetermined_advice(const ReportInput& in) {
  if (in.model.input != Signal::i_a && !some_run_has(in, Signal::i_a))
    return "Record `i_a_A` (a multimeter will do), which separates R_{a} from K_{b}; or fix one of them: `fixed: "
           "true`, or an "
           "ohmmeter's reading as `prior: {value, std}`";
  if (!some_run_has(in, Signal::torque))
    return "Where K_{m} is among them: tie it to K_{b} (`tie: {K_m: K_b}`) or record a torque that varies. Else record "
           "runs "
           "that move it: a coast-down, a reversal, a staircase to full speed";
  return "Record runs that move it, e.g. a coast-down, a reversal or a staircase to full speed; or fix it from a data "
         "sheet";
}

std::string stem_of(const std::string& file) { return std::filesystem::path(file).stem().string(); }

/// ` MODEL SESSION... [--held-out ...] [--map ...]` for the next command.
std::string files_of(const ReportInput& in) {
  std::string train, held;
  std::vector<std::string> seen;
  for (const ReportRun& r : in.runs) {
    if (std::ranges::find(seen, r.spec) != seen.end()) continue;
    seen.push_back(r.spec);
    (r.held_out ? held : train) += " " + shell_quoted(r.spec);
  }
  return " " + shell_quoted(in.model_file) + train + (held.empty() ? "" : " --held-out" + held) +
         (in.map_file.empty() ? "" : " --map " + shell_quoted(in.map_file)) +
         (in.candidates_file.empty() ? "" : " --candidates " + shell_quoted(in.candidates_file));
}

void next_steps(Page& page, const ReportInput& in, const Diagnosis& d) {
  std::vector<std::string> items;
  std::string command;
  if (!d.missing.empty()) {
    const std::string out = stem_of(in.model_file) + "-with-" + d.id(d.missing.front().effect) + ".yaml";
    command = d.missing.size() == 1
                  ? "emtb add " + d.id(d.missing.front().effect) + files_of(in) + " --out " + out
                  : "emtb diagnose" + files_of(in) + " --out " + stem_of(in.model_file) + "-final.yaml";
    items.push_back(
        "Put into the model what was found, with the command below; or save the final model from the last section.");
  }
  for (const MissingEffect& m : d.missing) {
    for (const std::size_t rival : m.tied_with)
      items.push_back("Tell " + std::string(d.about(m.effect).name) + " from " + std::string(d.about(rival).name) +
                      ". " + std::string(d.about(m.effect).told_apart));
  }
  if (!d.next.empty()) items.push_back(in_words(d.next.front()));
  if (d.verdict == Verdict::unknown_effect)
    items.push_back(
        "Look for what remains in the residual maps below: the condition against which the final model's mean "
        "residual still bends is what the missing effect depends on. Where it bends against none, the cause is "
        "not recorded: temperature, angle, a belt, a supply.");
  if (d.verdict == Verdict::nothing_missing)
    items.push_back(
        "Use the model. The table of candidates says which effects these runs would have shown, and from which "
        "size on; smaller ones may hide.");
  if (d.verdict == Verdict::cannot_tell)
    items.push_back("Record runs in which the motor turns: steps to two levels and a staircase, at least.");
  if (!d.undetermined.empty()) {
    std::vector<std::string> list;
    for (const Undetermined& u : d.undetermined) list.push_back(combination(u));
    items.push_back("These runs do not determine " + joined(list, " nor ") + " (relative changes). " +
                    undetermined_advice(in) + ".");
  }
  if (d.judged_on_training)
    items.push_back(
        "Record a second run, of another shape, and name it with `--held-out`: one run cannot judge its own fit.");
  if (items.empty()) return;
  page.subsection("What to do next").list(items);
  if (!command.empty()) page.code(command);
}

void verdict_section(Page& page, const ReportInput& in, const Diagnosis& d) {
  page.section("Verdict").lead(verdict_in_words(d));
  page.paragraph(
      "Errors are given in noise floors: 1 means that the model is off by no more than the instruments scatter.");
  for (const MissingEffect& m : d.missing) {
    const EffectInfo& e = d.about(m.effect);
    std::string name(e.name);
    name[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(name[0])));
    page.paragraph(name + " (`" + std::string(e.id) + "`): " + std::string(e.what) + " " + "Equation: `" +
                   std::string(e.equation) + "`.");
  }
  std::vector<std::vector<std::string>> rows;
  for (const auto& [signal, fit] : d.signals) {
    rows.push_back({compared_symbol(signal), printed(fit.rmse, 3), printed_unit(info(signal).unit),
                    printed(fit.noise.sigma, 3), printed(fit.ratio, 3),
                    printed(std::round(100 * fit.fit_percent) / 100, 4) + " %"});
  }
  page.table("What remains with the final model, on " + judged_on(d), "lrlrrr",
             {"signal", "RMSE", "unit", "noise floor σ", "RMSE/σ", "fit"}, rows);
  next_steps(page, in, d);
}

void overlay_section(Page& page, const ReportInput& in, const Diagnosis& d, const Dataset& data) {
  page.section("Measured over simulated");
  page.paragraph(
      in.model.input == Signal::u_ref
          ? "Each unit is driven by what was measured before it, so that an error shows where it arises: the "
            "driver by u_{ref}, the motor by the measured voltage, the shaft by the measured torque."
      : in.model.input == Signal::e_a ? "The model is driven by the recorded terminal voltage e_{a}."
                                      : "The model is driven by the recorded current i_{a}.");
  std::size_t train = 0, held = 0;
  for (const ReportRun& r : in.runs) {
    const Record& record = r.held_out ? data.held_out[held++] : data.train[train++];
    const std::string name = short_name(r.run.name) + (r.held_out ? ", held out" : ", training");
    page.subsection(name);
    const std::vector<Overlay> after = overlays(record, d.final);
    std::vector<Overlay> before;
    if (!d.missing.empty()) before = overlays(record, d.base);
    for (std::size_t s = 0; s < after.size(); ++s) {
      page.figure(overlay_figure(name, after[s], before.empty() ? std::optional<Overlay>{} : before[s]));
    }
  }
}

void where_section(Page& page, const Diagnosis& d) {
  page.section("Where it fails");
  page.paragraph(
      "The mean residual (measured − simulated) of all runs, against one condition at a time. A model that lacks "
      "nothing stays "
      "within the grey band (± one noise floor of a single reading) wherever one looks; a bend says on what the "
      "missing "
      "effect depends.");
  std::map<Signal, const ResidualMap*> first;  // of each signal, the map that tells most
  for (const ResidualMap& m : d.where) first.try_emplace(m.signal, &m);
  std::vector<const ResidualMap*> order(first.size());
  std::ranges::transform(first, order.begin(), [](const auto& of_signal) { return of_signal.second; });
  std::ranges::stable_sort(order, std::ranges::greater{},
                           [](const ResidualMap* m) { return *std::ranges::max_element(m->ratio); });
  for (const ResidualMap* most : order) {
    const ResidualMap& m = *most;
    const std::vector<NamedFigure> figures = residual_map_figures(m.signal, d);
    if (figures.empty()) continue;
    std::string caption = "Residual of " + compared_symbol(m.signal) +
                          ", the most telling condition first: " + condition_axis(m.against).label + " explains " +
                          printed(100 * m.explained, 2) + " % of its variance with the base model";
    for (const ResidualMap& after : d.where_final) {
      if (!d.missing.empty() && after.signal == m.signal && after.against == m.against)
        caption += ", " + printed(100 * after.explained, 2) + " % with the final one";
    }
    page.small_multiples(figures, caption + ".");
  }
}

void parameter_section(Page& page, const Diagnosis& d) {
  page.section("Parameters");
  std::vector<std::vector<std::string>> rows;
  const std::vector<std::string> names = d.final.names(), base_names = d.base.names();
  const std::vector<double> values = d.final.values(), base_values = d.base.values();
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (d.final.input == Signal::i_a && (names[i] == "R_a" || names[i] == "K_b")) continue;  // not in its equations
    const Parameter& p = d.final.at(i);
    const std::string unit = printed_unit(p.unit);
    std::string meaning, remark, before = "–", interval = "–";
    for (const BaseParameter& b : base_parameters)
      if (b.symbol == names[i]) meaning = b.name;
    const std::size_t dot = names[i].find('.');
    if (dot != std::string::npos) meaning = "`" + names[i].substr(0, dot) + "`";
    if (const auto j = std::ranges::find(base_names, names[i]); j != base_names.end()) {
      const auto k = static_cast<std::size_t>(j - base_names.begin());
      const Parameter& old = d.base.at(k);
      before = old.std_error ? printed(base_values[k], *old.std_error) : printed(base_values[k]);
    }
    const double margin = 1e-7 * (p.max - p.min);  // as calibrate() judges
    const auto tie = d.final.tie.find(names[i]);
    if (tie != d.final.tie.end()) {
      remark = "= " + symbol_of(tie->second) + " (tied)";
    } else if (p.fixed) {
      remark = "fixed";
    } else if (p.value <= p.min + margin || p.value >= p.max - margin) {
      remark = "rests on its bound";
    } else if (p.prior) {
      remark = "prior " + printed(p.prior->value, p.prior->std);
    }
    if (p.std_error && tie == d.final.tie.end())
      interval = printed_range(values[i] - normal_95 * *p.std_error, values[i] + normal_95 * *p.std_error);
    const bool free = !p.fixed && tie == d.final.tie.end();
    std::string bounds = free ? printed(p.min) + " … " + printed(p.max) : "";
    if (!remark.empty()) bounds.append(bounds.empty() ? "" : "; ").append(remark);
    rows.push_back({symbol_of(names[i].substr(dot == std::string::npos ? 0 : dot + 1)), meaning, before,
                    p.std_error ? printed(values[i], *p.std_error) : printed(values[i]), interval, unit, bounds});
  }
  page.table("Values ± standard errors, which hold for correlated residuals too (block sandwich)", "llrrrll",
             {"", "parameter", "base model", "final model", "95 % interval", "unit", "bounds"}, rows);
  page.figure(parameter_figure(d));
  if (d.undetermined.empty()) {
    page.paragraph("These runs determine every free parameter of the final model.");
    return;
  }
  std::vector<std::string> items;
  for (const Undetermined& u : d.undetermined)
    items.push_back(combination(u) + ": " +
                    (std::isfinite(u.relative_error) && u.relative_error < 100
                         ? "±" + printed(100 * u.relative_error, 2) + " %"
                         : std::string("anything fits as well")));
  page.paragraph("These runs do not determine, in relative changes:").list(items);
}

void candidate_section(Page& page, const Diagnosis& d) {
  page.section("Candidates");
  page.paragraph(
      "Every effect of the library, and every formula on offer, that the base model does not have, best first. "
      "Visibility: the share of what it "
      "does "
      "that the "
      "fitted parameters cannot imitate (0: an exact alias in these data). p: how often chance alone would promise as "
      "much. "
      "Found from: the size that the whole procedure would have found in these data with a probability of 0.8.");
  std::vector<std::vector<std::string>> rows;
  for (const Candidate& c : d.candidates) {
    const EffectParameter& p = d.about(c.score.effect).parameter_list[0];
    const std::string unit = with_space(printed_unit(p.unit)), symbol = symbol_of(std::string(p.symbol));
    const double size = c.score.detectable_size;
    const bool promises = c.score.predicted_drop >= 1;
    std::string expected = "–";
    if (promises)
      expected = c.score.expected().empty() ? "there" : symbol + " = " + printed(c.score.expected()[0], 3).append(unit);
    rows.push_back({"`" + d.id(c.score.effect) + "`", promises ? printed(c.score.predicted_drop, 3) : "< 1", expected,
                    printed(c.score.visibility, 2), c.score.p_value < 1e-12 ? "< 10⁻¹²" : printed(c.score.p_value, 2),
                    c.held_out_error ? printed(*c.held_out_error, 3) : "not refitted",
                    std::isfinite(size) && size > 0 ? printed(size, 2).append(unit) : "cannot be seen"});
  }
  page.table("Scores at the model without the effect, and the error once refitted with it", "lrrrrrr",
             {"effect", "predicted drop [σ²]", "expected", "visibility", "p", "held-out error", "found from"}, rows);
  if (d.candidates.empty()) return;
  page.figure(promise_figure(d));
  if (std::ranges::any_of(d.candidates, [](const Candidate& c) { return c.held_out_error.has_value(); }))
    page.figure(refit_figure(d));
}

void staircase_section(Page& page, const Diagnosis& d) {
  page.section("How the error falls").figure(staircase_figure(d));
  std::vector<std::vector<std::string>> rows;
  for (const Step& s : d.steps) rows.push_back({step_name(s), printed(s.train, 3), printed(s.held_out, 3)});
  page.table("Error in noise floors", "lrr",
             {"step", "training runs",
              d.judged_on_training ? "the one run"
              : d.left_one_out     ? "held out in turn"
                                   : "held-out runs"},
             rows);
}

void missing_section(Page& page, const Diagnosis& d) {
  page.section("What the equations lack", !d.missing_base.empty());
  for (const MissingCurve& base : d.missing_base) {
    const auto after = std::ranges::find_if(d.missing_final, [&](const MissingCurve& c) {
      return c.quantity == base.quantity && c.against == base.against;
    });
    const bool changed = !d.missing.empty() && after != d.missing_final.end();
    page.figure(missing_figure(base, changed ? std::optional(*after) : std::nullopt));
  }
  if (d.missing_base.empty())
    page.paragraph(
        "No missing torque or voltage was recovered from these runs: that takes a fast current or a speed that moves "
        "through its range. The residual maps above show where the model fails all the same.");
}

std::string source_in_words(const NoiseFloor& noise) {
  if (noise.from == "declared") return "declared in the model file";
  if (noise.from == "settled") return "scatter about a straight line in settled stretches";
  if (noise.from == "repeats") return "what repeated runs differ by";
  if (noise.from == "resolution") return "the instrument's resolution, LSB/√12";
  if (noise.from == "differences")
    return noise.lower_bound ? "differences of readings: a lower bound, coloured noise may be 3-4 times more"
                             : "differences of readings";
  return noise.from;
}

/// What became of a signal's readings, in words; their number left out is added to `left_out`.
std::string fate_of(const ReportRun& r, Signal signal, const Record& record, const Model& model,
                    std::size_t& left_out) {
  const auto observed = std::ranges::find(record.observations, signal, &Observation::signal);
  if (signal == model.input) return "drives the model";
  if (signal == Signal::armature_open) return "opens the armature circuit of the model";
  if (observed != record.observations.end()) {
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
    rows.push_back({compared_symbol(signal), printed(noise.sigma, 3), printed_unit(info(signal).unit),
                    source_in_words(noise), noise.from == "settled" ? printed(noise.autocorrelation, 2) : "–"});
  }
  page.table("Noise floor of each signal: the same for all models that are compared here", "lrllr",
             {"signal", "σ", "unit", "where it comes from", "autocorrelation"}, rows);
  page.paragraph(
      "Where the voltage moves fast or a measured input is noisy, a reading's σ is widened by what timing and that "
      "noise allow "
      "any model to know; the grey bands show it.");
  readings_tables(page, in, data);
  signals_lacking(page, in);
  page.subsection("As recorded");
  raw_figures(page, in, true);
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

std::string summary_of(const ReportInput& in) {
  std::size_t held = 0;
  for (const ReportRun& r : in.runs) held += r.held_out;
  const auto runs = [](std::size_t n, const std::string& kind) {
    return std::to_string(n) + " " + kind + (n == 1 ? " run" : " runs");
  };
  return "Model `" + in.model.name + "` beside " + runs(in.runs.size() - held, "training") + " and " +
         runs(held, "held-out") + ". " + in.date + ".";
}

}  // namespace

ReportInput ReportInput::of(std::string model_file, Model given, std::string command) {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  char date[32];
  std::strftime(date, sizeof date, "%Y-%m-%d %H:%M UTC", &parts);
  return {.model_file = std::move(model_file),
          .model = std::move(given),
          .runs = {},
          .map_file = {},
          .candidates_file = {},
          .software = std::string("emtb ") + version + (*commit == 0 ? "" : std::string(", commit ") + commit),
          .date = date,
          .command = std::move(command),
          .on_figure = {},
          .story = {}};
}

void ReportInput::add(const std::string& spec, bool as_held_out, const Mapping& mapping) {
  const SessionSpec parsed = parse_session_spec(spec);
  const std::vector<Run> used = read_runs(spec, mapping);
  const bool cut = parsed.t0 || parsed.t1;
  const std::string source = parsed.path.string() + (parsed.run.empty() ? "" : "#" + parsed.run);
  const std::vector<Run> whole = cut ? read_runs(source, mapping) : used;
  for (std::size_t i = 0; i < used.size(); ++i) {
    const double end = whole.at(i).duration();
    runs.push_back(
        {spec, as_held_out, used[i], whole[i], parsed.t0.value_or(0), std::min(parsed.t1.value_or(end), end)});
  }
}

std::vector<Run> ReportInput::part(bool held_out) const {
  std::vector<Run> list;
  for (const ReportRun& r : runs)
    if (r.held_out == held_out) list.push_back(r.run);
  return list;
}

std::string verdict_in_words(const Diagnosis& d) {
  const std::string found = missing_in_words(d);
  switch (d.verdict) {
    case Verdict::found:
      return "The model lacks " + found + ". With " + (d.missing.size() == 1 ? "it" : "them") + " the error on " +
             judged_on(d) + " falls " + fall(d) + "; nothing else is missing that these runs could show.";
    case Verdict::tied: {
      std::vector<std::string> rivals;
      for (const MissingEffect& m : d.missing) {
        std::vector<std::string> names;
        for (const std::size_t rival : m.tied_with) names.emplace_back(d.about(rival).name);
        if (!names.empty())
          rivals.push_back(joined(names, " or ") + " in the place of " + std::string(d.about(m.effect).name));
      }
      return "The model lacks " + found + ", or what does as well in these runs: " + joined(rivals) +
             ". The error on " + judged_on(d) + " falls " + fall(d) + " either way; other runs must tell which it is.";
    }
    case Verdict::unknown_effect:
      return d.missing.empty()
                 ? "Something is missing that no effect in the library explains: the error on " + judged_on(d) +
                       " is " + floors(d.final_held_out) + "."
                 : "The model lacks " + found + ": the error on " + judged_on(d) + " falls " + fall(d) + ". But " +
                       floors(d.final_held_out) +
                       " are more than noise: something else is missing that no effect in the library explains.";
    case Verdict::nothing_missing:
      return "Nothing is missing that these runs could show: the error on " + judged_on(d) + " is " +
             floors(d.final_held_out) + (d.missing.empty() ? "." : ", with " + found + ".");
    case Verdict::cannot_tell:
      return "These runs cannot tell: nothing in them moves enough to inform the model.";
  }
  return {};
}

Page report_page(const ReportInput& in, const Diagnosis& d) {
  const Dataset data = prepare(in.part(false), in.part(true), in.model);
  Page page("What the model `" + in.model.name + "` is missing", summary_of(in), in.on_figure);
  verdict_section(page, in, d);
  if (in.story) tell(page, *in.story, d);
  overlay_section(page, in, d, data);
  where_section(page, d);
  parameter_section(page, d);
  candidate_section(page, d);
  staircase_section(page, d);
  missing_section(page, d);
  data_section(page, in, data);
  repeat_section(page, in, &d);
  return page;
}

Page refusal_page(const ReportInput& in, const std::string& why) {
  Page page("The model `" + in.model.name + "` cannot be judged on these runs", summary_of(in), in.on_figure);
  page.section("Why not").lead(why);
  page.paragraph(
      "Nothing was fitted, and nothing can be said of what the model is missing. Below stands what was recorded.");
  signals_lacking(page, in);
  page.section("As recorded");
  raw_figures(page, in, false);
  repeat_section(page, in, nullptr);
  return page;
}

void write_page(const std::string& file, const Page& page, const std::string& option) {
  std::ofstream out(file);
  out << page.html();
  if (!out.flush()) throw Error(file + ": cannot be written. Give another " + option + " FILE.html");
}

}  // namespace emtb
