#include "report/investigation_story.h"

#include "analysis/record/dataset.h"
#include "figures/number.h"
#include "report/discovery_words.h"
#include "report/figures_of_diagnosis.h"
#include "report/text.h"
#include "report/words.h"

namespace emtb {
namespace {

std::string seconds(double s) { return pretty(s, 3) + " s"; }

std::string volts(const PlannedRuns& plan) { return pretty(plan.low()) + " to " + pretty(plan.high()) + " V"; }

std::string longer_runs(const PlannedRuns& plan) {
  return std::to_string(plan.count()) + " longer experiments, " + seconds(plan.seconds()) + " in all";
}

/// The experiment that was proposed, with the range and the length of one run of it.
std::string proposed(const PlannedRuns& plan) {
  return plan.proposal->what + " (" + volts(plan) + ", " + seconds(plan.proposal->profile.duration()) + ")";
}

/// `omega = 120 and 300 rad/s`
std::string places_of(const LawExperiment& e) {
  std::vector<std::string> at;
  for (const double x : e.at) at.push_back(pretty(x, 3));
  return e.over + " = " + joined(at) + " " + unit_over(e.over);
}

/// What was run after a round, and why.
std::string then_in_words(const PlannedRuns& plan) {
  switch (plan.why) {
    case PlannedRuns::Why::no_sessions:
    case PlannedRuns::Why::undecided:
      return "six experiments to begin with";
    case PlannedRuns::Why::unnamed:
      return longer_runs(plan);
    case PlannedRuns::Why::unsure_law:
      return "runs at " + places_of(*plan.law) + ", where the law " + plan.law->formula + " was least sure";
    case PlannedRuns::Why::tied:
      return "`" + plan.proposal->profile.name() + "`: " + proposed(plan) +
             ", twice, which was to bring the predictions " + pretty(plan.proposal->separation, 2) +
             " noise floors apart";
    case PlannedRuns::Why::to_be_foretold:
      return "a run that was foretold";
  }
  return {};
}

void tell_rounds(Page& page, const Investigation& investigation) {
  std::vector<std::vector<std::string>> rows;
  for (const InvestigationRound& r : investigation.rounds) {
    rows.push_back({std::to_string(rows.size() + 1), std::to_string(r.sessions),
                    printed(r.base, 3) + " → " + printed(r.final, 3), answer_of(r),
                    r.then ? then_in_words(*r.then) : "–"});
  }
  page.section("How it was found out");
  page.paragraph(
      "After each diagnosis the bench ran what would tell more, until the verdict stood or nothing that it can run "
      "would "
      "have told more. Errors are those of held-out runs, in noise floors, of the model as given and with what was "
      "found.");
  page.table("Round by round", "rrlll", {"round", "sessions to fit to", "error", "answer", "run after it"}, rows);
}

void tell_foretold(Page& page, const ForetoldRun& foretold, const Diagnosis& d) {
  page.section("Foretold, then measured");
  page.lead("What the found model said of a run before it was made is off by " +
            printed(foretold.final.chained_error, 3) +
            " noise floors, from the driver's reference alone; what the given model would have said, by " +
            printed(foretold.base.chained_error, 3) + ".");
  page.paragraph("The prediction is `" + foretold.prediction + "`, the run that followed it `" +
                 foretold.recording.name + "`.");
  const std::vector<Record> record = prepare(foretold.recording.runs, {}, foretold.judge, Chaining::chained).train;
  const std::vector<Overlay> found = overlays(record[0], d.final), given = overlays(record[0], d.base);
  for (std::size_t s = 0; s < found.size(); ++s) {
    NamedFigure figure = overlay_figure("the run that was foretold", found[s], given[s]);
    figure.name = "foretold_" + std::string(info(found[s].signal).name);
    page.figure(figure);
  }
}

}  // namespace

std::string question(const PlannedRuns& plan) {
  switch (plan.why) {
    case PlannedRuns::Why::no_sessions:
    case PlannedRuns::Why::undecided:
      return std::string(plan.why == PlannedRuns::Why::undecided ? "These sessions leave it open."
                                                                 : "No sessions are given.") +
             " Six experiments: " + volts(plan) + ", " + seconds(plan.seconds()) + " in all?";
    case PlannedRuns::Why::unnamed:
      return "What is left has no name yet. Run " + longer_runs(plan) + "?";
    case PlannedRuns::Why::unsure_law:
      return "What is left follows a law, " + plan.law->formula + ". It is least sure at " + places_of(*plan.law) +
             ". Run there, to fit to and once more to judge by (" + volts(plan) + ", " + seconds(plan.seconds()) +
             " in all)?";
    case PlannedRuns::Why::tied:
      return "Run, to fit to and once more to judge by: " + proposed(plan) + "?";
    case PlannedRuns::Why::to_be_foretold:
      return "Run it (" + volts(plan) + ", " + seconds(plan.seconds()) + ")?";
  }
  return {};
}

std::string answer_of(const InvestigationRound& round) {
  std::string text(word(round.verdict));
  for (std::size_t i = 0; i < round.missing.size(); ++i) {
    text += (i == 0 ? ": " : ", ") + std::string("`") + round.missing[i].id + "`";
    for (const std::string& rival : round.missing[i].tied_with) text += " or `" + rival + "`";
  }
  return text;
}

void tell(Page& page, const Investigation& investigation) {
  tell_rounds(page, investigation);
  if (investigation.foretold) tell_foretold(page, *investigation.foretold, *investigation.diagnosis);
}

}  // namespace emtb
