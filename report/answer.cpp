#include "report/answer.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string_view>

#include "analysis/fit/gauge.h"
#include "hal/printable.h"
#include "hal/unit.h"
#include "model/catalogue.h"
#include "report/text.h"
#include "report/verdict.h"
#include "report/words.h"

namespace emtb {
namespace {

std::string listed(const std::vector<std::string>& files) {
  std::string text;
  for (const std::string& file : files) text += " " + shell_quoted(file);
  return text;
}

std::string stem(const std::string& file) { return std::filesystem::path(file).stem().string(); }

std::string error_cell(double error) { return pretty(error, 3); }

/// ` if R_a is 2.9 ohm`: the values of held parameters with which this one goes; nothing where it goes with none.
std::string as_far_as_pins_are_right(const Diagnosis& d, const std::string& parameter) {
  std::vector<std::string> held;
  for (const std::string& name : scaled_with(d.pins, parameter)) {
    const auto pin = std::ranges::find(d.pins, name, &Pin::parameter);
    if (pin != d.pins.end()) held.push_back(pin->parameter + " is " + pretty(pin->value, 3) + with_space(pin->unit));
  }
  return held.empty() ? "" : " if " + joined(held);
}

/// `coulomb_friction (T = ...)`, or with the rivals that do as well.
std::string what_is_missing(const Diagnosis& d) {
  std::vector<std::string> names;
  for (const MissingEffect& m : d.missing) {
    std::vector<std::string> either{d.id(m.effect)};
    for (const std::size_t rival : m.tied_with) either.push_back(d.id(rival));
    names.push_back(either.size() > 1       ? "one of " + joined(either, " or ")
                    : d.missing.size() == 1 ? either[0] + " (" + std::string(d.about(m.effect).name) + ")"
                                            : either[0]);
  }
  if (d.verdict == Verdict::unknown_effect) names.emplace_back("something that no effect of the library explains");
  if (d.verdict == Verdict::cannot_tell) return "not to be told from these runs";
  return names.empty() ? "nothing that these runs show" : joined(names);
}

/// The least size that a run would have shown; nothing where the effect cannot have it.
std::string found_from(const Diagnosis& d, const Candidate& c) {
  const EffectInfo& about = d.about(c.score.effect);
  const double size = c.score.detectable_size;
  const bool possible =
      std::isfinite(size) && size > 0 && !about.parameters().empty() && size <= std::abs(about.parameters()[0].max);
  return possible ? pretty(size, 2) : "-";
}

std::string how_large(const Diagnosis& d) {
  std::vector<std::string> values;
  for (const MissingEffect& m : d.missing) {
    for (const Parameter& p : fitted_values(d, m)) {
      values.push_back((d.missing.size() > 1 ? d.id(m.effect) + "." : "") + value_in_words(p) +
                       as_far_as_pins_are_right(d, d.id(m.effect) + "." + p.symbol));
    }
  }
  if (!values.empty()) return joined(values, ", ");
  const auto would_show = [&](const Candidate& c) { return found_from(d, c) != "-"; };
  const auto first = std::ranges::find_if(d.candidates, would_show);
  if (first == d.candidates.end() || !d.missing.empty() || d.verdict != Verdict::nothing_missing) return "-";
  const EffectParameter& p = d.about(first->score.effect).parameters()[0];
  return d.id(first->score.effect) + ", for one, would have shown from " + std::string(p.symbol) + " = " +
         found_from(d, *first) + with_space(p.unit);
}

std::string before_and_after(const Diagnosis& d) {
  const std::string held = d.judged_on_training ? "the run itself" : d.left_one_out ? "held out in turn" : "held out";
  const auto from_to = [](double from, double to) { return error_cell(from) + " -> " + error_cell(to); };
  return from_to(d.base_held_out, d.final_held_out) + " noise floors " + held + ", " +
         from_to(d.base_train, d.final_train) + " in training";
}

}  // namespace

std::string how_sure(const Diagnosis& d) {
  std::string judged = d.judged_on_training ? " (one run, judged on itself: record a second)"
                       : d.only_training_shows_it()
                           ? " (shown by training runs alone: each was held out in turn, beside those you named)"
                           : "";
  if (!d.fitted_too.empty()) judged += " (" + fitted_too_in_words(d) + ")";
  const std::string verdict = std::string(word(d.verdict)) + ": ";
  switch (d.verdict) {
    case Verdict::found: {
      const auto named = [&](const Candidate& c) {
        return std::ranges::find(d.missing, c.score.effect, &MissingEffect::effect) != d.missing.end();
      };
      const auto other = std::ranges::find_if(d.candidates, [&](const Candidate& c) { return !named(c); });
      constexpr double clearly = 1.1;
      const bool worse =
          other != d.candidates.end() && other->held_out_error && *other->held_out_error > clearly * d.final_held_out;
      return verdict +
             (worse ? "the best other effect, " + d.id(other->score.effect) + ", leaves " +
                          error_cell(*other->held_out_error) + " noise floors"
              : d.cut ? "no other effect that was tried does as well"
                      : "no other effect does as well") +
             judged;
    }
    case Verdict::tied:
      return verdict + "these runs do not tell them apart" + judged;
    case Verdict::unknown_effect:
      return verdict + error_cell(d.final_held_out) + " noise floors remain without a name" +
             (d.shown_by.empty() ? ""
                                 : ", and only " + joined(d.shown_by) + (d.shown_by.size() == 1 ? " shows" : " show") +
                                       " it: training runs do not, or by far less") +
             judged;
    case Verdict::nothing_missing:
      return verdict + std::string(nothing_in_words(d)) + judged;
    case Verdict::cannot_tell:
      return verdict + "nothing in these runs moves enough to inform the model";
  }
  return {};
}

std::string as_arguments(const NamedFiles& f) {
  return " " + shell_quoted(f.model) + listed(f.sessions) +
         (f.held_out.empty() ? "" : " --held-out" + listed(f.held_out)) +
         (f.map.empty() ? "" : " --map " + shell_quoted(f.map)) +
         (f.candidates.empty() ? "" : " --candidates " + shell_quoted(f.candidates));
}

namespace {

/// ` ID` of an effect of the library that is tied with another; nothing where all of them are formulas.
std::string one_of_the_tied(const Diagnosis& d) {
  for (const MissingEffect& m : d.missing) {
    if (m.tied_with.empty()) continue;
    for (const std::size_t other : m.tied_with) {
      if (other < effect_count) return " " + d.id(other);
    }
    if (m.effect < effect_count) return " " + d.id(m.effect);
  }
  return {};
}

/// The same with one held-out session, that of a run, among the training sessions; none where no session is its.
std::optional<NamedFiles> trained_on_too(NamedFiles f, const std::string& run) {
  for (const std::string_view less : {"", "@", "#@"}) {  // its run and span, its run, or its file
    const auto session = std::ranges::find_if(f.held_out, [&](const std::string& spec) {
      return less.empty() ? run == spec : run.starts_with(spec.substr(0, spec.find_first_of(less)));
    });
    if (session == f.held_out.end()) continue;
    f.sessions.push_back(*session);
    f.held_out.erase(session);
    return f;
  }
  return std::nullopt;
}

}  // namespace

std::string next_command(const Diagnosis& d, const NamedFiles& named) {
  NamedFiles f = named;
  for (const std::string& run : d.fitted_too) f = trained_on_too(f, run).value_or(f);
  NamedFiles plain = f;
  plain.candidates.clear();  // of commands that take none
  const std::string out = shell_quoted(stem(f.model) + "-final.yaml");
  switch (d.verdict) {
    case Verdict::found:
      if (!f.out.empty()) break;
      if (d.missing.size() != 1) return "emtb diagnose" + as_arguments(f) + " --out " + out;
      return "emtb add " + d.id(d.missing[0].effect) + as_arguments(f) + " --out " +
             shell_quoted(stem(f.model) + "-with-" + d.id(d.missing[0].effect) + ".yaml");
    case Verdict::tied:
      if (!d.next.empty() && !f.map.empty()) {  // no bench of emtb made these: its page shows what to record
        return "emtb report" + as_arguments(f) + " --out " + shell_quoted(stem(f.model) + ".html");
      }
      if (!d.next.empty()) {
        return "emtb investigate " + shell_quoted(f.model) + " --sessions" + listed(f.sessions) +
               (f.held_out.empty() ? "" : " --held-out" + listed(f.held_out));
      }
      return "emtb effects" + one_of_the_tied(d);
    case Verdict::unknown_effect:
      if (!d.shown_by.empty()) {
        if (const auto more = trained_on_too(f, d.shown_by.front())) return "emtb diagnose" + as_arguments(*more);
      }
      return "emtb report" + as_arguments(f) + " --out " + shell_quoted(stem(f.model) + ".html");
    case Verdict::nothing_missing:
      if (!f.out.empty()) break;
      return "emtb calibrate" + as_arguments(plain) + " --out " + out;
    case Verdict::cannot_tell:
      return "emtb profiles";
  }
  return "emtb compare " + shell_quoted(f.out) + listed(f.held_out.empty() ? f.sessions : f.held_out) +
         (f.map.empty() ? "" : " --map " + shell_quoted(f.map));
}

std::string answer_text(const Diagnosis& d, const NamedFiles& files) {
  std::string text;
  const auto line = [&](const char* what, const std::string& says) { text += what + printable(says) + "\n"; };
  line("missing  ", what_is_missing(d));
  line("size     ", how_large(d));
  line("sure     ", how_sure(d));
  line("error    ", before_and_after(d));
  line("next     ", next_command(d, files));
  return text;
}

std::string candidates_text(const Diagnosis& d, std::size_t shown, std::size_t width) {
  const bool all = shown == 0;
  const std::size_t rows = all ? d.candidates.size() : std::min(shown, d.candidates.size());
  std::vector<std::string> heading{"candidate", "held-out", "drop", "expected", "found from", "unit"};
  if (all) heading.insert(heading.end(), {"visibility", "p"});
  Table table(heading);
  for (std::size_t i = 0; i < rows; ++i) {
    const Candidate& c = d.candidates[i];
    const EffectInfo& about = d.about(c.score.effect);
    const bool sized = !c.score.expected().empty() && !about.parameters().empty();
    std::vector<std::string> row{
        std::string(about.id),
        c.held_out_error ? error_cell(*c.held_out_error) : "-",
        pretty(c.score.predicted_drop, 2),
        sized ? std::string(about.parameters()[0].symbol) + " " + pretty(c.score.expected()[0], 3) : "there",
        found_from(d, c),
        sized ? shown_unit(about.parameters()[0].unit) : ""};
    if (all) row.insert(row.end(), {pretty(c.score.visibility, 2), pretty(c.score.p_value, 2)});
    table.row(row);
  }
  const std::string legend =
      "Candidates, best first: by held-out, the error on held-out runs with the effect (1 = noise floor); then, where "
      "it was not refitted (-), by drop, the predicted fall of the sum of squares. found from: the least size that "
      "these runs would show; -: none that it can have." +
      std::string(all ? " visibility: the share of its signature that no fitted parameter imitates. p: of chance."
                      : "");
  std::string text = wrapped(legend, width) + "\n" + table.text();
  if (rows < d.candidates.size()) {
    text += std::to_string(rows) + " of " + std::to_string(d.candidates.size()) + "; --all shows the rest\n";
  }
  return text;
}

}  // namespace emtb
