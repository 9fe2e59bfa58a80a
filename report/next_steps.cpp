#include "report/next_steps.h"

#include <algorithm>
#include <filesystem>

#include "figures/number.h"
#include "report/answer.h"
#include "report/gauge_words.h"
#include "report/symbols.h"
#include "report/text.h"
#include "report/words.h"

namespace emtb {
namespace {

std::string stem_of(const std::string& file) { return std::filesystem::path(file).stem().string(); }

NamedFiles files_of(const ReportInput& in) {
  NamedFiles files{.model = in.model_file, .map = in.map_file, .candidates = in.candidates_file};
  std::vector<std::string> seen;
  for (const ReportRun& r : in.runs) {
    if (std::ranges::find(seen, r.spec) != seen.end()) continue;
    seen.push_back(r.spec);
    (r.held_out ? files.held_out : files.sessions).push_back(r.spec);
  }
  return files;
}

}  // namespace

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

void next_steps(Page& page, const ReportInput& in, const Diagnosis& d) {
  std::vector<std::string> items;
  std::string command;
  if (!d.missing.empty()) {
    const std::string out = stem_of(in.model_file) + "-with-" + d.id(d.missing.front().effect) + ".yaml";
    command = d.missing.size() == 1
                  ? "emtb add " + d.id(d.missing.front().effect) + as_arguments(files_of(in)) + " --out " + out
                  : "emtb diagnose" + as_arguments(files_of(in)) + " --out " + stem_of(in.model_file) + "-final.yaml";
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
  for (const Pin& pin : d.pins) items.push_back(in_words(pin, Names::on_a_page));
  if (!d.undetermined.empty()) {
    std::vector<std::string> list;
    for (const Undetermined& u : d.undetermined) list.push_back(combination(u));
    items.push_back("These runs do not determine " + joined(list, " nor ") +
                    " (relative changes). To determine them: " +
                    advice_on(d.undetermined, d.final, recorded_by(d.data->train)) + ".");
  }
  if (d.judged_on_training)
    items.push_back(
        "Record a second run, of another shape, and name it with `--held-out`: one run cannot judge its own fit.");
  if (items.empty()) return;
  page.subsection("What to do next").list(items);
  if (!command.empty()) page.code(command);
}

}  // namespace emtb
