#include "tests/blind/table.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "analysis/diagnose/loss.h"
#include "hal/error.h"
#include "tests/blind/text.h"

namespace emtb::blind {
namespace {

constexpr std::string_view begin_mark = "<!-- tables: written by blind_judge -->";
constexpr std::string_view end_mark = "<!-- end of tables -->";

constexpr double diagnosis_limit = 10;  // [s] on two idle cores

bool failed(const Answer& a) { return a.verdict.starts_with("failed"); }
bool made(const Answer& a) { return !a.verdict.starts_with("not made"); }

/// Does the answer say that something is left that nothing explains?
bool states_remainder(const Answer& a) {
  return a.verdict == "unknown_effect" || a.unexplained * a.unexplained > 1 + Materiality{}.remainder;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::ranges::sort(values);
  return values[std::min(values.size() - 1, static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}

std::string joined(const std::vector<std::string>& list, std::string_view between) {
  std::string text;
  for (const std::string& item : list) text += (text.empty() ? "" : std::string(between)) + item;
  return text;
}

std::string named(const Answer& a) {
  std::vector<std::string> names;
  for (const Answer::Named& m : a.missing) {
    names.push_back(m.tied_with.empty() ? m.id : m.id + " ~ " + joined(m.tied_with, " ~ "));
  }
  return names.empty() ? "nothing" : joined(names, " + ");
}

std::string percent(double share) { return rounded(100 * share, share > 0 && share < 0.1 ? 1 : 0) + " %"; }

bool hides_one(const Answer& a) { return a.kind == "single" && made(a) && a.lacking.empty(); }

/// Is the case one that somebody should look at?
bool missed(const Answer& a) {
  if (!made(a)) return false;
  if (failed(a)) return true;
  if (!a.lacking.empty()) return false;
  if (a.kind == "outside") return !states_remainder(a);
  const Grade g = grade(a);
  if (a.kind == "healthy") return !g.wrong.empty();
  return !g.all_right();
}

struct Row {
  std::string what, target;
  Share share;
  bool met = false;
};

std::string targets(const Scores& s) {
  const std::vector<Row> rows{
      {"one effect: named, alone or in a tie of at most three, nothing wrong beside it", ">= 95 %", s.single_named,
       s.single_named.value() >= 0.95},
      {"one effect: named alone and first, where the data can tell", ">= 90 %", s.single_alone,
       s.single_alone.value() >= 0.90},
      {"healthy, rho 0 to 0.97: anything named", "<= 4 %", s.healthy_named, s.healthy_named.value() <= 0.04},
      {"two effects: both named, nothing wrong beside them", ">= 85 %", s.pair_both, s.pair_both.value() >= 0.85},
      {"two effects: at least one named", ">= 97 %", s.pair_any, s.pair_any.value() >= 0.97},
      {"outside the library: unknown_effect, or a remainder stated", ">= 90 %", s.outside_stated,
       s.outside_stated.value() >= 0.90},
      {"95 % intervals of effects that cover the truth (library's laws)", "88 to 99 %", s.covered,
       s.covered.value() >= 0.88 && s.covered.value() <= 0.99},
      {"a diagnosis takes " + rounded(diagnosis_limit, 0) + " s or less", "all", s.in_time,
       s.in_time.count == s.in_time.of}};
  std::string text = "| what | target | measured | cases | 95 % interval | met |\n|---|---|---|---|---|---|\n";
  for (const Row& row : rows) {
    const Interval i = wilson(row.share);
    text += "| " + row.what + " | " + row.target + " | " + percent(row.share.value()) + " | " +
            std::to_string(row.share.count) + " of " + std::to_string(row.share.of) + " | " + percent(i.low) + " to " +
            percent(i.high) + " | " +
            (row.share.of == 0 ? "-"
             : row.met         ? "yes"
                               : "no") +
            " |\n";
  }
  text += "| held-out error after adding, true sigma, median where named right | <= 1.05 | " +
          rounded(s.final_error, 3) + " | " + std::to_string(s.single_named.count) + " | | " +
          (s.final_error <= 1.05 ? "yes" : "no") + " |\n";
  text += "\nBeside the targets: of the single effects named right, " + percent(s.single_clean.value()) +
          " left no material remainder; of the healthy benches, " + percent(s.healthy_unknown.value()) + " (" +
          std::to_string(s.healthy_unknown.count) + " of " + std::to_string(s.healthy_unknown.of) +
          ") were said to have an unknown effect; intervals of R_a, K_b, B and J cover in " +
          percent(s.base_covered.value()) + " (" + std::to_string(s.base_covered.count) + " of " +
          std::to_string(s.base_covered.of) + "); a diagnosis takes " + rounded(s.seconds, 1) + " s in the median, " +
          rounded(s.slowest, 1) + " s in 19 of 20 cases, and " + rounded(s.cpu_seconds, 1) + " s of processor time; " +
          std::to_string(s.failed) +
          " failed. Cases about an effect that the library lacks: " + std::to_string(s.lacking_stated.of) +
          ", of which " + std::to_string(s.lacking_stated.count) +
          " were answered with a remainder. Not made, since no bench showed the effect: " + std::to_string(s.not_made) +
          ".\n";
  return text;
}

/// One line for each truth: how it fared, and what was said in its stead.
std::string confusion(std::span<const Answer> answers) {
  struct Fate {
    std::size_t cases = 0, alone = 0, tied = 0, beside = 0, wrong = 0, nothing = 0, unknown = 0;
    std::map<std::string, std::size_t> instead;
  };
  std::map<std::string, Fate> fates;
  for (const Answer& a : answers) {
    if (!made(a) || (a.kind != "single" && a.kind != "healthy" && a.kind != "outside")) continue;
    std::string truth = a.kind == "healthy" ? "(healthy)" : a.truth.front();
    if (a.kind == "outside") truth = "(outside) " + truth;
    if (!a.lacking.empty()) truth = "(lacking) " + (a.kind == "healthy" ? "healthy, driver off" : truth);
    Fate& fate = fates[truth];
    const Grade g = grade(a);
    ++fate.cases;
    const bool found = g.any_found();
    if (found && g.wrong.empty())
      ++(g.alone.front() ? fate.alone : fate.tied);
    else if (found)
      ++fate.beside;
    else if (!g.wrong.empty())
      ++fate.wrong;
    else
      ++fate.nothing;
    if (a.verdict == "unknown_effect") ++fate.unknown;
    for (const std::string& id : g.wrong) ++fate.instead[id];
  }
  std::string text =
      "| truth | cases | alone | tied | wrong beside | wrong | nothing | unknown_effect | wrong names |\n"
      "|---|---|---|---|---|---|---|---|---|\n";
  for (const auto& [truth, f] : fates) {
    text += "| " + truth;
    for (const std::size_t n : {f.cases, f.alone, f.tied, f.beside, f.wrong, f.nothing, f.unknown}) {
      text += " | " + (n == 0 ? "" : std::to_string(n));
    }
    std::vector<std::string> wrong;
    for (const auto& [id, n] : f.instead) wrong.push_back(n == 1 ? id : id + " x" + std::to_string(n));
    text += " | " + joined(wrong, ", ") + " |\n";
  }
  return text;
}

std::string misses(std::span<const Answer> answers, const std::map<std::string, std::string>& causes) {
  std::string text =
      "| case | bench | truth | size | verdict | named | held-out before, after | what else | cause |\n"
      "|---|---|---|---|---|---|---|---|---|\n";
  for (const Answer& a : answers) {
    if (!missed(a)) continue;
    std::vector<std::string> sizes;
    for (const double size : a.size) sizes.push_back(rounded(size, 2));
    const auto cause = causes.find(a.id);
    text += "| " + a.id + " | " + a.bench + " | " + joined(a.truth, " + ") + " | " + joined(sizes, ", ") + " | " +
            a.verdict + " | " + named(a) + " | " + rounded(a.linear_error, 2) + ", " + rounded(a.final_error, 2) +
            " | " + a.nuisance + " | " + (cause == causes.end() ? "" : cause->second) + " |\n";
  }
  return text;
}

/// The last column of the page's misses, by the first.
std::map<std::string, std::string> causes_on(const std::string& page) {
  std::map<std::string, std::string> causes;
  std::istringstream lines(page);
  for (std::string line; std::getline(lines, line);) {
    const bool is_case =
        std::ranges::any_of(std::vector<std::string>{"| healthy:", "| single:", "| pair:", "| outside:"},
                            [&](const std::string& start) { return line.starts_with(start); });
    const auto end = line.rfind(" |");
    if (!is_case || end == std::string::npos) continue;
    const auto begin = line.rfind("| ", end - 1);
    const std::string id = line.substr(2, line.find(" |", 2) - 2);
    if (begin != std::string::npos && begin + 2 < end) causes[id] = line.substr(begin + 2, end - begin - 2);
  }
  return causes;
}

}  // namespace

Interval wilson(const Share& share) {
  if (share.of == 0) return {};
  constexpr double z = 1.959964;
  const double n = static_cast<double>(share.of), p = share.value();
  const double middle = (p + z * z / (2 * n)) / (1 + z * z / n);
  const double half = z / (1 + z * z / n) * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  return {std::max(middle - half, 0.0), std::min(middle + half, 1.0)};
}

Scores score(std::span<const Answer> answers) {
  Scores s;
  std::vector<double> errors, seconds, cpu;
  for (const Answer& a : answers) {
    if (!made(a)) {
      ++s.not_made;
      continue;
    }
    if (failed(a))
      ++s.failed;
    else
      seconds.push_back(a.seconds), cpu.push_back(a.cpu_seconds), s.in_time.add(a.seconds <= diagnosis_limit);
    if (!a.lacking.empty()) {
      s.lacking_stated.add(states_remainder(a));
      continue;
    }
    const Grade g = grade(a);
    const auto count = [](Share& share, const std::vector<Covered>& intervals) {
      for (const Covered& c : intervals) share.add(std::abs(c.value - c.truth) <= 1.96 * c.std_error);
    };
    if (g.all_right() && a.laws == "usual" && a.kind != "outside") {
      count(s.covered, a.intervals);
      if (a.tolerated.empty()) count(s.base_covered, a.base_intervals);
    }
    if (hides_one(a)) {
      s.single_named.add(g.all_right());
      if (data_can_tell(a)) s.single_alone.add(g.all_right() && g.alone.front());
      if (g.all_right()) {
        errors.push_back(a.final_error);
        s.single_clean.add(!states_remainder(a));
      }
    } else if (a.kind == "healthy") {
      s.healthy_named.add(failed(a) || !g.wrong.empty());
      s.healthy_unknown.add(g.wrong.empty() && a.verdict == "unknown_effect");
    } else if (a.kind == "pair") {
      s.pair_both.add(g.all_right());
      s.pair_any.add(g.any_found());
    } else if (a.kind == "outside") {
      s.outside_stated.add(!failed(a) && states_remainder(a));
    }
  }
  s.final_error = quantile(errors, 0.5);
  s.seconds = quantile(seconds, 0.5);
  s.slowest = quantile(seconds, 0.95);
  s.cpu_seconds = quantile(cpu, 0.5);
  return s;
}

std::string line_of(const Answer& a) {
  std::string truth = a.truth.empty() ? std::string("-") : "";
  for (std::size_t t = 0; t < a.truth.size(); ++t) {
    truth += (t == 0 ? "" : " + ") + a.truth[t] + " x" + rounded(a.size[t], 2);
  }
  return std::string(missed(a)           ? "MISS "
                     : a.lacking.empty() ? "     "
                                         : "lack ") +
         a.id + " [" + a.bench + (a.nuisance.empty() ? "" : ", " + a.nuisance) + "] " + truth + ": " + a.verdict +
         ", " + named(a) + "; " + rounded(a.linear_error, 2) + " -> " + rounded(a.final_error, 3) + "; " +
         rounded(a.seconds, 1) + " s";
}

std::string tables(std::span<const Answer> answers, const std::map<std::string, std::string>& causes) {
  return "### Targets\n\n" + targets(score(answers)) + "\n### Truth and answer\n\n" + confusion(answers) +
         "\n### Misses\n\n" + misses(answers, causes);
}

void update_page(const std::filesystem::path& page, std::span<const Answer> answers) {
  std::ifstream in(page);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto begin = text.find(begin_mark), end = text.find(end_mark);
  if (!in || begin == std::string::npos || end == std::string::npos || end < begin) {
    throw Error(page.string() + ": has no `" + std::string(begin_mark) + "` ... `" + std::string(end_mark) +
                "` to write between. Name another --page, or `--page none`");
  }
  const auto from = begin + begin_mark.size();
  text.replace(from, end - from, "\n\n" + tables(answers, causes_on(text)) + "\n");
  std::ofstream out(page);
  out << text;
  if (!out.flush()) throw Error(page.string() + ": cannot be written. Name another --page");
}

}  // namespace emtb::blind
