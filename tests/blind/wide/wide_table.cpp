#include "tests/blind/wide/wide_table.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/blind/text.h"

namespace emtb::blind::wide {
namespace {

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

bool failed(const WideAnswer& a) { return a.verdict.starts_with("failed"); }

std::string percent(double share) { return rounded(100 * share, share > 0 && share < 0.1 ? 1 : 0) + " %"; }

struct Row {
  std::string what, target;
  Share share;
};

std::vector<Row> rows(const WideScores& s) {
  return {{"one effect: named, nothing wrong beside", ">= 95 %", s.single},
          {"one effect, named right: `unknown_effect` all the same", "", s.single_remainder},
          {"healthy: anything named", "<= 2 %", s.healthy_named},
          {"healthy: `unknown_effect`", "<= 3 %", s.healthy_unknown},
          {"two effects: all named, nothing wrong beside", ">= 88 %", s.pair},
          {"three effects: all named, nothing wrong beside", ">= 75 %", s.triple},
          {"outside the library: wrong name without a stated remainder", "<= 5 %", s.outside_wrong},
          {"outside the library: nothing named, no remainder stated", "", s.outside_silent},
          {"95 % intervals of effects that cover", "92 to 98 %", s.covered},
          {"95 % intervals of R_a, K_b, B, J that cover", "92 to 98 %", s.base_covered},
          {"garbage, contradicted: caught and named", ">= 95 %", s.caught},
          {"garbage, not contradicted: remarked", "", s.remarked},
          {"false findings of `check`", "<= 2 %", s.false_findings}};
}

std::string by_trait(std::span<const WideAnswer> answers) {
  struct Shares {
    Share single, several, named, unknown, base;
  };
  std::map<std::string, std::map<std::string, Shares>> table;
  for (const WideAnswer& a : answers) {
    if (!counts(a) || undecidable(a)) continue;
    const Grade g = grade(a);
    for (const auto& [trait, value] : a.traits) {
      Shares& s = table[trait][value];
      if (a.kind == "single") s.single.add(!failed(a) && g.all_right());
      if (a.kind == "pair" || a.kind == "triple") s.several.add(!failed(a) && g.all_right());
      if (a.kind == "healthy") {
        s.named.add(failed(a) || !g.wrong.empty());
        s.unknown.add(a.verdict == "unknown_effect");
      }
      if ((a.kind == "healthy" && g.wrong.empty()) || (a.kind == "single" && g.all_right())) {
        for (const Covered& c : a.base_intervals) s.base.add(std::abs(c.value - c.truth) <= 1.96 * c.std_error);
      }
    }
  }
  std::string out =
      "| trait | | one named | two, three named | healthy named | healthy unknown | base covered "
      "|\n|---|---|---|---|---|---|---|\n";
  const auto cell = [](const Share& s) {
    return s.of == 0 ? std::string() : std::to_string(s.count) + " of " + std::to_string(s.of);
  };
  for (const auto& [trait, values] : table) {
    for (const auto& [value, s] : values) {
      out += "| " + trait + " | " + value + " | " + cell(s.single) + " | " + cell(s.several) + " | " + cell(s.named) +
             " | " + cell(s.unknown) + " | " + cell(s.base) + " |\n";
    }
  }
  return out;
}

std::string named(const WideAnswer& a) {
  std::string out;
  for (const auto& m : a.missing) {
    out += (out.empty() ? "" : " + ") + m.id;
    for (const auto& rival : m.tied_with) out += "|" + rival;
  }
  return out.empty() ? "nothing" : out;
}

}  // namespace

WideScores wide_score(std::span<const WideAnswer> answers) {
  WideScores s;
  std::vector<double> seconds, secret;
  for (const WideAnswer& a : answers) {
    if (a.verdict.starts_with("not made")) {
      ++s.not_made;
      continue;
    }
    if (a.findings && a.garbage.empty()) s.false_findings.add(!false_findings(a).empty());
    if (!a.garbage.empty()) {
      if (!a.findings) {
        ++s.unchecked;
        continue;
      }
      const bool found =
          std::ranges::any_of(*a.findings, [&](const auto& f) { return f.starts_with(a.garbage + " "); });
      if (a.contradicted)
        s.caught.add(found);
      else
        s.remarked.add(!a.findings->empty());
      continue;
    }
    if (!a.lacking.empty()) {
      ++s.lacking;
      continue;
    }
    if (failed(a))
      ++s.failed;
    else
      seconds.push_back(a.seconds);
    const Grade g = grade(a);
    const bool right = !failed(a) && g.all_right();
    if (a.kind == "healthy") {
      s.healthy_named.add(failed(a) || !g.wrong.empty());
      s.healthy_unknown.add(a.verdict == "unknown_effect");
    } else if (a.kind == "outside") {
      s.outside_wrong.add(failed(a) || (!g.wrong.empty() && !states_remainder(a)));
      s.outside_silent.add(!failed(a) && g.wrong.empty() && !states_remainder(a));
    } else if (undecidable(a)) {
      ++s.undecidable;
    } else {
      (a.kind == "single" ? s.single : a.kind == "pair" ? s.pair : s.triple).add(right);
    }
    if (a.kind == "single" && right) s.single_remainder.add(a.verdict == "unknown_effect");
    if (a.kind == "outside" || !right) continue;
    for (const auto& [signal, error] : a.secret) secret.push_back(error);
    if (a.traits.at("laws") != "usual" && a.kind != "healthy") continue;
    for (const Covered& c : a.intervals) s.covered.add(std::abs(c.value - c.truth) <= 1.96 * c.std_error);
    for (const Covered& c : a.base_intervals) s.base_covered.add(std::abs(c.value - c.truth) <= 1.96 * c.std_error);
  }
  s.seconds = quantile(seconds, 0.5);
  s.slowest = quantile(seconds, 0.95);
  s.secret = quantile(secret, 0.5);
  return s;
}

std::string line_of(const WideAnswer& a) {
  std::string truth;
  for (std::size_t t = 0; t < a.truth.size(); ++t) {
    truth += (t == 0 ? "" : " + ") + a.truth[t] + " x" + rounded(a.size[t], 2);
  }
  if (!a.garbage.empty()) truth = a.garbage_how + (a.contradicted ? "" : " (not contradicted)");
  const auto trait = [&](const char* name) {
    const auto found = a.traits.find(name);
    return found == a.traits.end() ? std::string("-") : found->second;
  };
  std::string what = a.verdict + ", " + named(a) + "; " + rounded(a.base, 2) + " -> " + rounded(a.unexplained, 2);
  if (!a.garbage.empty()) {
    what = a.verdict;
    for (const auto& f : a.findings.value_or(std::vector<std::string>{})) what += "; " + f;
  }
  if (a.nats)
    what += "; oracle " + rounded(*a.nats, 1) + " nats over " + a.rival + ", truth " + rounded(a.truth_error, 2);
  if (!a.why_not.empty()) what += "; no oracle: " + a.why_not;
  const char* mark = missed(a) ? "MISS " : undecidable(a) ? "?    " : !a.lacking.empty() ? "lack " : "     ";
  return mark + a.id + " [" + trait("machine") + ", " + trait("speed") + ", " + trait("rate") + ", loop " +
         trait("loop") + ", current " + trait("current") + "] " + (truth.empty() ? "-" : truth) + ": " + what + "; " +
         rounded(a.seconds, 1) + " s";
}

std::string wide_tables(std::span<const WideAnswer> answers) {
  const WideScores s = wide_score(answers);
  std::string out = "| what | target | measured | cases | 95 % interval |\n|---|---|---|---|---|\n";
  for (const Row& row : rows(s)) {
    const Interval i = wilson(row.share);
    out += "| " + row.what + " | " + row.target + " | ";
    if (row.share.of == 0) {
      out += "not asked | 0 | |\n";
      continue;
    }
    out += percent(row.share.value()) + " | " + std::to_string(row.share.count) + " of " +
           std::to_string(row.share.of) + " | " + percent(i.low) + " to " + percent(i.high) + " |\n";
  }
  out += "\nApart: " + std::to_string(s.undecidable) + " undecidable, " + std::to_string(s.lacking) +
         " about an effect that the library lacks, " + std::to_string(s.not_made) + " not made, " +
         std::to_string(s.failed) + " failed";
  if (s.unchecked > 0) out += ", " + std::to_string(s.unchecked) + " with garbage SKIPPED: this emtb has no `check`";
  out += ". A diagnosis takes " + rounded(s.seconds, 1) + " s in the median, " + rounded(s.slowest, 1) +
         " s in 19 of 20 cases. Error of the final model on runs that nobody handed out, median over signals where the "
         "names are right: " +
         rounded(s.secret, 3) + " floors.\n\n" + by_trait(answers);
  return out;
}

std::string wide_summary(std::span<const WideAnswer> answers) {
  const WideScores s = wide_score(answers);
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Row& row : rows(s)) {
    const Interval i = wilson(row.share);
    list.push_back({{"what", row.what},
                    {"target", row.target},
                    {"count", row.share.count},
                    {"of", row.share.of},
                    {"low", i.low},
                    {"high", i.high}});
  }
  const nlohmann::ordered_json out = {
      {"rows", list},           {"undecidable", s.undecidable}, {"lacking", s.lacking},
      {"not_made", s.not_made}, {"failed", s.failed},           {"unchecked", s.unchecked},
      {"seconds", s.seconds},   {"slowest", s.slowest},         {"secret_error", s.secret}};
  return out.dump(2) + "\n";
}

}  // namespace emtb::blind::wide
