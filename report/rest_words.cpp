#include "report/rest_words.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "figures/number.h"
#include "hal/unit.h"
#include "report/text.h"
#include "report/words.h"

namespace emtb {
namespace {

constexpr int digits = 2;    // of what is derived: an rms of readings that hang together is hardly better
constexpr int measured = 3;  // as in the tables

/// As a terminal of any kind shows it.
std::string letter_of(const Prefix& prefix) { return prefix.size == 1e-6 ? "u" : prefix.letter; }

std::string word_for(Signal signal) {
  switch (signal) {
    case Signal::omega:
      return "speed";
    case Signal::theta:
      return "angle";
    case Signal::torque:
      return "load torque";
    case Signal::i_a:
      return "current";
    case Signal::e_a:
      return "terminal voltage";
    default:
      return std::string(info(signal).meaning);
  }
}

/// `98.27`: below a hundredth of a percent nothing is told.
std::string percent(double value) { return pretty(std::round(100 * value) / 100 + 0.0, 4); }

/// `0.4 of a sample`
std::string part_of_a_sample(double share) {
  return share > 0.99 ? "one sample" : pretty(share, digits) + " of a sample";
}

/// ` (3 % of that applied)`; nothing where as good as nothing is applied.
std::string share_of_applied(double share) {
  constexpr double any = 100;
  if (!(share < any)) return {};
  return share > 1 ? " (" + pretty(share, digits) + " times that applied)"
                   : " (" + pretty(100 * share, digits) + " % of that applied)";
}

std::string how_well_known(const NoiseFloor& noise) {
  return noise.upper_bound ? " at most" : noise.lower_bound ? " at least" : "";
}

}  // namespace

std::string with_scaled_unit(double value, const std::string& unit, int figures) {
  const Prefix p = prefix_for(value);
  return pretty(value / p.size, figures) + " " + letter_of(p) + unit;
}

bool has_multiples(const NoiseFloor& noise) { return !noise.upper_bound; }

std::string in_words(Signal signal, const SignalFit& fit) {
  const Rest& rest = fit.rest;
  const std::string unit(info(signal).unit);
  if (!std::isfinite(fit.rmse)) return word_for(signal) + " cannot be compared: its simulation leaves all bounds";
  std::string text = word_for(signal) + " wrong by " + with_scaled_unit(fit.rmse, unit, measured) + " rms (" +
                     (fit.moves ? "fit " + percent(fit.fit_percent) + " %" : "it does not move") +
                     "); the instrument explains ";
  if (rest.rms <= 0) {
    text += fit.noise.lower_bound ? "that" : "all of it";
  } else {
    const Prefix p = prefix_for(fit.rmse);
    text += pretty(fit.noise.sigma / p.size, measured) + how_well_known(fit.noise);
    std::vector<std::string> what;
    if (rest.hops) what.push_back("is another in each reading, as noise is");
    if (rest.lasts > 0) what.push_back("lasts " + with_scaled_unit(rest.lasts, "s"));
    if (rest.like > 0) {
      what.push_back(signal == Signal::i_a ? "is like a voltage of " + with_scaled_unit(rest.like, "V")
                                           : "is like a torque of " + with_scaled_unit(rest.like, "N m"));
      what.back() += share_of_applied(rest.like / rest.applied);
    }
    if (!what.empty()) text += "; the rest " + joined(what);
  }
  if (has_multiples(fit.noise)) text += "; " + pretty(fit.ratio, 3) + " noise floors";
  return text;
}

std::vector<std::string> in_words(const std::map<Signal, SignalFit>& fits) {
  std::vector<std::string> lines;
  for (const auto& [signal, fit] : fits) lines.push_back(in_words(signal, fit));
  return lines;
}

std::string signals_text(const std::map<Signal, SignalFit>& fits, const std::map<Signal, double>& chained) {
  std::vector<std::string> heading{"signal", "RMSE", "unit", "noise floor", "from", "RMSE/floor", "fit"};
  if (!chained.empty()) heading.push_back("chained RMSE/floor");
  Table table(heading);
  for (const auto& [signal, f] : fits) {
    std::vector<std::string> row{std::string(info(signal).name),
                                 pretty(f.rmse, measured),
                                 shown_unit(info(signal).unit),
                                 pretty(f.noise.sigma, measured),
                                 std::string(name_of(f.noise.from)),
                                 has_multiples(f.noise) ? pretty(f.ratio, measured) : "-",
                                 f.moves ? percent(f.fit_percent) + " %" : "-"};
    if (const std::string bound = how_well_known(f.noise); !bound.empty()) row[4] += " (" + bound.substr(1) + ")";
    if (const auto c = chained.find(signal); c != chained.end()) {
      row.push_back(has_multiples(f.noise) ? pretty(c->second, measured) : "-");
    }
    table.row(row);
  }
  std::string text;
  for (const std::string& line : in_words(fits)) text += line + "\n";
  return text + "\n" + table.text();
}

std::string in_words(const Timing& timing, double interval, const Model& model) {
  const std::string what = model.input == Signal::u_ref ? "the reference" : std::string(info(model.input).meaning);
  std::vector<std::string> parts;
  const double share = interval > 0 ? std::abs(timing.acts_after) / interval : 0;
  const bool as_recorded = timing.acts_after == 0;
  const std::string by = share >= 0.01 ? ", by " + part_of_a_sample(share) : "";
  const std::string row = timing.rows_early > 0 ? "the row before its own" : "its row";
  if (timing.acts_after < 0) parts.push_back(what + " acts before the readings of " + row + by);
  if (timing.acts_after > 0) parts.push_back(what + " acts after the readings of its row" + by);
  if (as_recorded) parts.push_back(what + " acts from its row on");
  if (timing.held) parts.push_back("holds until the next");
  std::string text = joined(parts, " and ");
  if (timing.voltage_late > 0) text += "; " + word_for(Signal::e_a) + " is read one row late";
  for (const auto& [signal, late] : timing.late) {
    if (late > 0) text += "; " + word_for(signal) + " is read " + part_of_a_sample(late) + " late";
  }
  if (timing.meters_at_once) text += "; slow meters read what is there, not means since the reading before";
  return text;
}

}  // namespace emtb
