#include "report/report_page.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <map>

#include "figures/number.h"
#include "hal/error.h"
#include "hal/unit.h"
#include "report/answer.h"
#include "report/data_section.h"
#include "report/discovery_figures.h"
#include "report/figures_of_diagnosis.h"
#include "report/investigation_story.h"
#include "report/next_steps.h"
#include "report/parameter_section.h"
#include "report/rest_words.h"
#include "report/symbols.h"
#include "report/verdict.h"
#include "report/words.h"

namespace emtb {
namespace {

std::string summary_of(const ReportInput& in) {
  std::size_t held = 0;
  for (const ReportRun& r : in.runs) held += r.held_out;
  const auto runs = [](std::size_t n, const std::string& kind) {
    return std::to_string(n) + " " + kind + (n == 1 ? " run" : " runs");
  };
  return "Model `" + in.model.name + "` beside " + runs(in.runs.size() - held, "training") + " and " +
         runs(held, "held-out") + ". " + in.date + ".";
}

std::string capital(std::string text) {
  text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

/// A run with what both models make of it.
struct ShownRun {
  std::string name;
  bool held_out = false;
  std::vector<Overlay> after, before;  ///< of the final model and of the base model; none where they are one

  std::optional<Overlay> before_of(std::size_t signal) const {
    return before.empty() ? std::optional<Overlay>{} : before[signal];
  }
};

std::vector<ShownRun> shown_runs(const ReportInput& in, const Diagnosis& d) {
  std::vector<ShownRun> runs;
  std::size_t train = 0, held = 0;
  for (const ReportRun& r : in.runs) {
    const Record& record = r.held_out ? d.data->held_out[held++] : d.data->train[train++];
    runs.push_back({short_name(r.run.name) + (r.held_out ? ", held out" : ", training"),
                    r.held_out,
                    overlays(record, d.final),
                    {}});
    if (!d.missing.empty()) runs.back().before = overlays(record, d.base);
  }
  return runs;
}

/// Where the base model is furthest off, on a run that judges.
struct Worst {
  std::size_t run = 0, signal = 0;
};

std::optional<Worst> worst_of(const std::vector<ShownRun>& runs) {
  const bool judged = std::ranges::any_of(runs, &ShownRun::held_out);
  std::optional<Worst> worst;
  double most = 0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    if (judged && !runs[r].held_out) continue;
    const std::vector<Overlay>& base = runs[r].before.empty() ? runs[r].after : runs[r].before;
    for (std::size_t s = 0; s < base.size(); ++s) {
      if (base[s].floors() > most) most = base[s].floors(), worst = Worst{r, s};
    }
  }
  return worst;
}

const MissingCurve* of_final(const Diagnosis& d, const MissingCurve& base) {
  const auto after = std::ranges::find_if(
      d.missing_final, [&](const MissingCurve& c) { return c.quantity == base.quantity && c.against == base.against; });
  return d.missing.empty() || after == d.missing_final.end() ? nullptr : &*after;
}

NamedFigure missing_figure_of(const Diagnosis& d, const MissingCurve& base) {
  const MissingCurve* after = of_final(d, base);
  return missing_figure(base, after != nullptr ? std::optional(*after) : std::nullopt);
}

/// What the whole page is about: where the model was furthest off, and what its equations lack.
void hero(Page& page, const Diagnosis& d, const std::vector<ShownRun>& runs) {
  const std::optional<Worst> worst = worst_of(runs);
  if (!worst) return;
  const ShownRun& run = runs[worst->run];
  std::vector<NamedFigure> figures{hero_figure(run.name, run.after[worst->signal], run.before_of(worst->signal))};
  if (!d.missing_base.empty()) {
    NamedFigure missing = missing_figure_of(d, d.missing_base.front());
    missing.name += "_at_a_glance";
    missing.figure.wide(370);
    missing.caption = "What would have to be added to the equations for them to hold, with its 95 % band.";
    figures.push_back(std::move(missing));
  }
  page.side_by_side(figures);
}

void verdict_section(Page& page, const ReportInput& in, const Diagnosis& d, const std::vector<ShownRun>& runs) {
  page.section("Verdict").lead(verdict_in_words(d));
  hero(page, d, runs);
  std::vector<std::pair<std::string, std::string>> facts;
  for (const MissingEffect& m : d.missing) {
    const EffectInfo& e = d.about(m.effect);
    facts.emplace_back(capital(std::string(e.name)),
                       std::string(e.what) + " `" + std::string(e.equation) + "` (`" + std::string(e.id) + "`)");
  }
  facts.emplace_back("How sure", capital(how_sure(d)) + ".");
  if (!d.signals.empty()) {
    const auto worst = std::ranges::max_element(d.signals, {}, [](const auto& entry) { return entry.second.ratio; });
    facts.emplace_back("What is left", capital(in_words(worst->first, worst->second)) + ".");
  }
  facts.emplace_back("Noise floor",
                     "An error of 1 is what the instruments scatter: no model gets below it but by chance.");
  page.facts(facts);
  next_steps(page, in, d);
  std::vector<std::vector<std::string>> rows;
  for (const auto& [signal, fit] : d.signals) {
    const std::string unit = printed_unit(info(signal).unit);
    rows.push_back({compared_symbol(signal), printed(fit.rmse, unit, 3), printed(fit.noise.sigma, unit, 3),
                    has_multiples(fit.noise) ? printed(fit.ratio, 3) : "–",
                    fit.moves ? printed(std::round(100 * fit.fit_percent) / 100, 4) + " %" : "does not move"});
  }
  page.fold("What is left, signal by signal");
  page.table("With the final model, on " + judged_on(d), "lrrrr", {"signal", "RMSE", "noise floor σ", "RMSE/σ", "fit"},
             rows);
  std::vector<std::string> lines = in_words(d.signals);
  for (std::string& line : lines) line = capital(std::move(line)) + ".";
  page.list(lines).end_fold();
}

void overlay_section(Page& page, const ReportInput& in, const std::vector<ShownRun>& runs) {
  page.section("Measured over simulated");
  page.paragraph(
      in.model.input == Signal::u_ref
          ? "Each unit is driven by what was measured before it, so that an error shows where it arises: the "
            "driver by u_{ref}, the motor by the measured voltage, the shaft by the measured torque."
      : in.model.input == Signal::e_a ? "The model is driven by the recorded terminal voltage e_{a}."
                                      : "The model is driven by the recorded current i_{a}.");
  const std::optional<Worst> worst = worst_of(runs);
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const ShownRun& run = runs[r];
    page.fold(run.name, worst && worst->run == r);
    for (std::size_t s = 0; s < run.after.size(); ++s)
      page.figure(overlay_figure(run.name, run.after[s], run.before_of(s)));
    page.end_fold();
  }
}

/// Is no mean residual of a signal further from zero than a reading scatters, against nothing, with either model?
bool stays_within(Signal signal, const Diagnosis& d) {
  const auto fit = d.signals.find(signal);
  if (fit == d.signals.end()) return false;
  const auto within = [&](const ResidualMap& m) {
    return m.signal != signal ||
           std::ranges::all_of(m.mean, [&](double mean) { return std::abs(mean) <= fit->second.noise.sigma; });
  };
  return std::ranges::all_of(d.where, within) && std::ranges::all_of(d.where_final, within);
}

void where_section(Page& page, const Diagnosis& d) {
  page.section("Where it fails");
  page.paragraph(
      "The mean residual (measured − simulated) of all runs, against one condition at a time, with 95 % bars: readings "
      "near each other count as one. A model that lacks nothing stays within the grey band (± one noise floor of a "
      "single reading) wherever one looks; a bend says on what the missing effect depends.");
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
    const bool within = stays_within(m.signal, d);
    if (within) page.fold(compared_symbol(m.signal) + " stays within the band wherever one looks");
    page.small_multiples(figures, caption + ".");
    if (within) page.end_fold();
  }
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
  page.fold("All candidates, with their scores");
  page.table("Scores at the model without the effect, and the error once refitted with it", "lrrrrrr",
             {"effect", "predicted drop [σ²]", "expected", "visibility", "p", "held-out error", "found from"}, rows)
      .end_fold();
  for (const std::string& line : refused(d)) page.paragraph(line + ".");
  for (const std::string& line : not_tried(d)) page.paragraph(line + ".");
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
  for (const MissingCurve& base : d.missing_base) page.figure(missing_figure_of(d, base));
  if (d.missing_base.empty())
    page.paragraph(
        "No missing torque or voltage was recovered from these runs: that takes a fast current or a speed that moves "
        "through its range. The residual maps above show where the model fails all the same.");
}

}  // namespace

Page report_page(const ReportInput& in, const Diagnosis& d) {
  const Dataset& data = *d.data;
  const std::vector<ShownRun> runs = shown_runs(in, d);
  Page page("What the model `" + in.model.name + "` is missing", summary_of(in), in.on_figure);
  verdict_section(page, in, d, runs);
  if (in.investigation != nullptr) tell(page, *in.investigation);
  overlay_section(page, in, runs);
  where_section(page, d);
  parameter_section(page, d);
  candidate_section(page, d);
  staircase_section(page, d);
  missing_section(page, d);
  if (in.discovery != nullptr) tell(page, *in.discovery);
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
