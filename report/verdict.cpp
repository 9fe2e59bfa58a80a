#include "report/verdict.h"

#include <algorithm>
#include <map>
#include <sstream>

#include "figures/number.h"
#include "hal/unit.h"
#include "report/rest_words.h"
#include "report/symbols.h"
#include "report/text.h"
#include "report/words.h"

namespace emtb {

namespace {

/// By how many noise floors a signal is off; none where it has no floor to speak of.
double multiples_of(const std::pair<const Signal, SignalFit>& signal_and_fit) {
  const SignalFit& fit = signal_and_fit.second;
  return has_multiples(fit.noise) ? fit.ratio : 0;
}

/// The signal that shows most of what remains: the others may be at their floors.
auto worst_signal(const Diagnosis& d) { return std::ranges::max_element(d.signals, {}, multiples_of); }

std::string remainder_in_words(const Diagnosis& d) {
  const auto worst = worst_signal(d);
  if (worst == d.signals.end() || multiples_of(*worst) == 0) return "what remains is more than noise";
  return in_words(worst->first, worst->second) + ". All signals together: " + pretty(d.final_held_out, 3) +
         " times the noise floor remains";
}

/// Is more left than noise, although it is worth no name?
bool more_than_noise(const Diagnosis& d) {
  constexpr double clearly = 1.25;  // noise floors
  return std::ranges::any_of(d.signals, [&](const auto& s) { return multiples_of(s) > clearly; });
}

/// Does a load have most of it, whose reading drives the model and so bends nothing else?
bool left_of_the_load(const Diagnosis& d) {
  const auto worst = worst_signal(d);
  return d.torque_only_loads && worst != d.signals.end() && worst->first == Signal::torque;
}

std::string_view what_is_left(const Diagnosis& d) {
  return left_of_the_load(d) ? "left of the load's law, while its reading loads the motor"
                             : "left, little or of no law that comes again";
}

std::string rest_without_law(const Diagnosis& d) {
  if (!more_than_noise(d)) return "";
  return left_of_the_load(d) ? " What is left beyond noise is most of all the load's own law; the motor is loaded by "
                               "what the gauge read."
                             : " What is left beyond noise is little, or follows no law that these runs show again.";
}

/// `Coulomb friction (T_c = 0.0547 ± 0.0003 N m)`
std::string in_words(const Diagnosis& d, const MissingEffect& m) {
  std::vector<std::string> values;
  for (const Parameter& p : fitted_values(d, m)) values.push_back(symbol_of(p.symbol) + " = " + value_of(p));
  return std::string(d.about(m.effect).name) + (values.empty() ? "" : " (" + joined(values, ", ") + ")");
}

std::string missing_in_words(const Diagnosis& d) {
  std::vector<std::string> list;
  for (const MissingEffect& m : d.missing) list.push_back(in_words(d, m));
  return joined(list);
}

/// Where an error falls, and by how much: where held-out runs show nothing of what was found, they have nothing to say.
std::string fall(const Diagnosis& d) {
  const auto from_to = [](double from, double to) { return " falls from " + floors(from) + " to " + printed(to, 3); };
  return d.only_training_shows_it() ? "the training runs, which alone show it," + from_to(d.base_train, d.final_train)
                                    : judged_on(d) + from_to(d.base_held_out, d.final_held_out);
}

/// What the base parameters would be with a rival in the place of what was named; nothing where they are the same.
std::string otherwise_in_words(const Diagnosis& d, const MissingEffect& m, std::size_t rival) {
  std::vector<std::string> values;
  for (const OtherValue& other : m.otherwise) {
    if (other.effect != rival) continue;
    const std::vector<std::string> names = d.final.names();
    const auto place = std::ranges::find(names, other.name) - names.begin();
    const Parameter& p = d.final.at(static_cast<std::size_t>(place));
    values.push_back(other.name + " = " + pretty(other.value, 4) + with_space(p.unit));
  }
  return joined(values);
}

}  // namespace

std::string_view nothing_in_words(const Diagnosis& d) {
  return more_than_noise(d) ? "what is left is too little to matter, or of no law that these runs show again"
                            : "what is left is noise, or too little to matter";
}

std::string verdict_text(const Diagnosis& d) {
  std::ostringstream out;
  switch (d.verdict) {
    case Verdict::found:
    case Verdict::tied:
      out << (d.verdict == Verdict::found ? "found:" : "found, but tied with others that do as well:");
      if (more_than_noise(d)) out << " (" << what_is_left(d) << ": " << remainder_in_words(d) << ")";
      break;
    case Verdict::unknown_effect:
      out << "unknown_effect: something is missing that nothing in the library explains; " << remainder_in_words(d)
          << (d.missing.empty() ? "." : ", even with");
      break;
    case Verdict::nothing_missing:
      out << "nothing_missing: " << nothing_in_words(d) << ".";
      if (more_than_noise(d))
        out << " (" << (left_of_the_load(d) ? what_is_left(d) : "left") << ": " << remainder_in_words(d) << ")";
      break;
    case Verdict::cannot_tell:
      out << "cannot_tell: nothing in these runs moves enough to inform the model.";
      break;
  }
  out << "\n";
  for (const MissingEffect& m : d.missing) {
    out << "  " << d.about(m.effect).id << " (" << d.about(m.effect).equation << ")";
    for (const Parameter& p : fitted_values(d, m)) out << "  " << value_in_words(p);
    out << "\n";
    for (const std::size_t rival : m.tied_with) {
      out << "    tied with " << d.about(rival).id << ": " << d.about(rival).told_apart << "\n";
      if (const std::string other = otherwise_in_words(d, m, rival); !other.empty())
        out << "      With it " << other << ".\n";
    }
  }
  if (!d.fitted_too.empty()) out << "  " << fitted_too_in_words(d) << "\n";
  if (d.cut) out << "  " << cut_in_words() << "\n";
  if (!d.next.empty()) out << "  " << in_words(d.next.front()) << "\n";
  return out.str();
}

namespace {

std::string answer_in_words(const Diagnosis& d) {
  const std::string found = missing_in_words(d);
  switch (d.verdict) {
    case Verdict::found:
      return "The model lacks " + found + ". With " + (d.missing.size() == 1 ? "it" : "them") + " the error on " +
             fall(d) + "; nothing else is missing that these runs could show." + rest_without_law(d);
    case Verdict::tied: {
      std::vector<std::string> rivals;
      std::string otherwise;
      for (const MissingEffect& m : d.missing) {
        std::vector<std::string> names;
        for (const std::size_t rival : m.tied_with) {
          names.emplace_back(d.about(rival).name);
          if (const std::string other = otherwise_in_words(d, m, rival); !other.empty())
            otherwise += " With " + names.back() + ", " + other + ".";
        }
        if (!names.empty())
          rivals.push_back(joined(names, " or ") + " in the place of " + std::string(d.about(m.effect).name));
      }
      return "The model lacks " + found + ", or what does as well in these runs: " + joined(rivals) +
             ". The error on " + fall(d) + " either way; other runs must tell which it is." + otherwise +
             rest_without_law(d);
    }
    case Verdict::unknown_effect:
      if (!d.shown_by.empty()) {
        return (d.missing.empty() ? "" : "The model lacks " + found + ". ") +
               "The training runs show nothing of it, or far less, but " + joined(d.shown_by) +
               (d.shown_by.size() == 1 ? " does: " : " do: ") + floors(d.final_held_out) + " remain on " +
               judged_on(d) + ". What acts there hardly acts in a training run. Diagnose again with " +
               (d.shown_by.size() == 1 ? "that run" : "one of those runs") + " among the training runs.";
      }
      return d.missing.empty()
                 ? "Something is missing that no effect in the library explains: the error on " + judged_on(d) +
                       " is " + floors(d.final_held_out) + "."
                 : "The model lacks " + found + ": the error on " + fall(d) + ". But " + floors(d.final_held_out) +
                       " are more than noise: something else is missing that no effect in the library explains.";
    case Verdict::nothing_missing:
      return "Nothing is missing that these runs could show: the error on " + judged_on(d) + " is " +
             floors(d.final_held_out) + (d.missing.empty() ? "." : ", with " + found + ".") + rest_without_law(d);
    case Verdict::cannot_tell:
      return "These runs cannot tell: nothing in them moves enough to inform the model.";
  }
  return {};
}

}  // namespace

std::string verdict_in_words(const Diagnosis& d) {
  return answer_in_words(d) + (d.fitted_too.empty() ? "" : " (" + fitted_too_in_words(d) + ".)") +
         (d.cut ? " " + cut_in_words() : "");
}

std::vector<std::string> refused(const Diagnosis& d) {
  std::vector<std::string> lines;
  for (const Candidate& c : d.candidates) {
    if (c.implausible.empty()) continue;
    lines.push_back(d.id(c.score.effect) + " would need an implausible value: " + c.implausible);
  }
  return lines;
}

std::vector<std::string> not_tried(const Diagnosis& d) {
  std::map<std::string, std::string> ids;  // by reason
  for (const Withheld& w : d.withheld) {
    std::string& list = ids[w.why];
    list += (list.empty() ? "" : ", ") + d.id(w.effect);
  }
  std::vector<std::string> lines;
  for (const auto& [why, list] : ids) lines.push_back("not tried: " + list + " (" + why + ")");
  if (d.torque_is_input) {
    lines.emplace_back(
        "the measured torque loads the shaft as it was read, and no law of the library leaves less than a fifth of it: "
        "--explain torque asks which comes nearest");
  }
  return lines;
}

}  // namespace emtb
