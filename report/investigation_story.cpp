#include "report/investigation_story.h"

#include "analysis/record/dataset.h"
#include "figures/number.h"
#include "report/figures_of_diagnosis.h"

namespace emtb {
namespace {

void tell_rounds(Page& page, const InvestigationStory& story) {
  std::vector<std::vector<std::string>> rows;
  for (const InvestigationStory::Round& r : story.rounds) {
    rows.push_back({std::to_string(rows.size() + 1), std::to_string(r.sessions),
                    printed(r.base, 3) + " → " + printed(r.final, 3), r.answer, r.then.empty() ? "–" : r.then});
  }
  page.section("How it was found out");
  page.paragraph(
      "After each diagnosis the bench ran what would tell more, until the verdict stood or nothing that it can run "
      "would "
      "have told more. Errors are those of held-out runs, in noise floors, of the model as given and with what was "
      "found.");
  page.table("Round by round", "rrlll", {"round", "sessions to fit to", "error", "answer", "run after it"}, rows);
}

void tell_foretold(Page& page, const InvestigationStory::Foretold& foretold, const Diagnosis& d) {
  page.section("Foretold, then measured");
  page.lead("What the found model said of a run before it was made is off by " + printed(foretold.final, 3) +
            " noise floors, from the driver's reference alone; what the given model would have said, by " +
            printed(foretold.base, 3) + ".");
  page.paragraph("The prediction is `" + foretold.prediction + "`, the run that followed it `" + foretold.session +
                 "`.");
  const std::vector<Record> record = prepare(std::span(&foretold.run, 1), {}, foretold.judge, Chaining::chained).train;
  const std::vector<Overlay> found = overlays(record[0], d.final), given = overlays(record[0], d.base);
  for (std::size_t s = 0; s < found.size(); ++s) {
    NamedFigure figure = overlay_figure("the run that was foretold", found[s], given[s]);
    figure.name = "foretold_" + std::string(info(found[s].signal).name);
    page.figure(figure);
  }
}

}  // namespace

std::string answer_of(const Diagnosis& d) {
  std::string text(word(d.verdict));
  for (std::size_t i = 0; i < d.missing.size(); ++i) {
    text += (i == 0 ? ": " : ", ") + std::string("`") + d.id(d.missing[i].effect) + "`";
    for (const std::size_t rival : d.missing[i].tied_with) text += " or `" + d.id(rival) + "`";
  }
  return text;
}

void tell(Page& page, const InvestigationStory& story, const Diagnosis& diagnosis) {
  tell_rounds(page, story);
  if (story.foretold) tell_foretold(page, *story.foretold, diagnosis);
}

}  // namespace emtb
