#include "report/verdict.h"

#include <algorithm>
#include <sstream>

#include "report/text.h"

namespace emtb {

namespace {

/// What remains, and the signal that shows it most: the others may be at their floors.
std::string remainder_in_words(const Diagnosis& d) {
  std::string text = pretty(d.final_held_out, 3) + " times the noise floor remains";
  const auto worst =
      std::ranges::max_element(d.signals, {}, [](const auto& signal_and_fit) { return signal_and_fit.second.ratio; });
  if (worst == d.signals.end() || d.signals.size() < 2) return text;
  return text + ", " + pretty(worst->second.ratio, 3) + " in " + std::string(info(worst->first).name);
}

}  // namespace

std::string verdict_text(const Diagnosis& d) {
  std::ostringstream out;
  switch (d.verdict) {
    case Verdict::found:
    case Verdict::tied:
      out << (d.verdict == Verdict::found ? "found:" : "found, but tied with others that do as well:");
      break;
    case Verdict::unknown_effect:
      out << "unknown_effect: something is missing that nothing in the library explains; " << remainder_in_words(d)
          << (d.missing.empty() ? "." : ", even with");
      break;
    case Verdict::nothing_missing:
      out << "nothing_missing: what is left is noise, or too little to matter.";
      break;
    case Verdict::cannot_tell:
      out << "cannot_tell: nothing in these runs moves enough to inform the model.";
      break;
  }
  out << "\n";
  for (const MissingEffect& m : d.missing) {
    out << "  " << d.about(m.effect).id << " (" << d.about(m.effect).equation << ")";
    for (const Parameter& p : m.parameters) {
      out << "  " << p.symbol << " = "
          << (p.std_error ? pretty(p.value, *p.std_error, p.unit) : pretty(p.value) + " " + p.unit);
    }
    out << "\n";
    for (const std::size_t rival : m.tied_with)
      out << "    tied with " << d.about(rival).id << ": " << d.about(rival).told_apart << "\n";
  }
  if (!d.next.empty()) out << "  " << in_words(d.next.front()) << "\n";
  return out.str();
}

}  // namespace emtb
