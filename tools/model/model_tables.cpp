#include "tools/model/model_tables.h"

#include <algorithm>
#include <cmath>
#include <iostream>

#include "hal/unit.h"
#include "report/gauge_words.h"
#include "report/rest_words.h"
#include "report/symbols.h"
#include "report/text.h"
#include "report/words.h"

namespace emtb {
namespace {

std::string in_words(const LikelihoodInterval& v) {
  return (v.low_at_bound ? "(bound) " : "") + pretty(v.low, 4) + " to " + pretty(v.high, 4) +
         (v.high_at_bound ? " (bound)" : "");
}

}  // namespace

std::string error_cell(std::optional<double> error) { return error ? pretty(*error, 3) : "-"; }

void print_parameters(const Model& model, const std::vector<std::string>& at_bound,
                      const std::vector<Undetermined>& undetermined, std::span<const Record> records,
                      const LikelihoodIntervals& intervals, std::span<const Pin> pins) {
  std::vector<std::string> heading{"parameter", "value", "+- std error", "unit", ""};
  if (!intervals.empty()) heading.insert(heading.end() - 1, "95 % by profile likelihood");
  Table table(heading);
  const std::vector<std::string> names = model.names();
  const std::vector<double> values = model.values();
  for (std::size_t i = 0; i < names.size(); ++i) {
    const Parameter& p = model.at(i);
    const auto tie = model.tie.find(names[i]);
    std::string remark;
    if (tie != model.tie.end()) {
      remark = "= " + tie->second;
    } else if (p.pinned) {
      remark = "held: see below";
    } else if (p.fixed) {
      remark = "fixed";
    } else if (std::ranges::find(at_bound, names[i]) != at_bound.end()) {
      remark = "rests on its bound";
    }
    const bool free = remark.empty();
    if (const auto with = scaled_with(pins, tie != model.tie.end() ? tie->second : names[i]); !with.empty()) {
      remark += (remark.empty() ? "" : ", ") + ("goes with " + joined(with));
    }
    std::vector<std::string> row{names[i], pretty(values[i], free && !is_determined(p) ? 2 : 5),
                                 error_in_words(p, free), shown_unit(p.unit)};
    if (!intervals.empty()) {
      const auto interval = intervals.find(names[i]);
      row.push_back(interval == intervals.end() ? "" : in_words(interval->second));
      if (interval != intervals.end() && remark.empty() && misled(p, interval->second)) {
        remark = "the standard error misleads";
      }
    }
    row.push_back(remark);
    table.row(row);
  }
  std::cout << table.text("", width_of_rows());
  for (const Pin& pin : pins) std::cout << fitted(in_words(pin), width_of_prose());
  for (const Undetermined& u : undetermined) std::cout << fitted(in_words(u), width_of_prose());
  if (!undetermined.empty()) {
    std::cout << fitted("To determine " + std::string(undetermined.size() == 1 ? "it" : "them") + ": " +
                            advice_on(undetermined, model, recorded_by(records)),
                        width_of_prose());
  }
}

void print_where(const std::vector<ResidualMap>& maps, const std::map<Signal, SignalFit>& signals) {
  std::vector<Signal> shown;
  for (const ResidualMap& m : maps) {
    const auto fit = signals.find(m.signal);
    if (fit == signals.end() || fit->second.ratio < above_the_floor || m.against == Condition::time ||
        m.against == Condition::direction)
      continue;
    if (std::ranges::find(shown, m.signal) != shown.end() || m.bins.size() < 3) continue;
    shown.push_back(m.signal);
    double largest = 0;
    for (const double mean : m.mean) largest = std::max(largest, std::abs(mean));
    std::cout << "\n"
              << info(m.signal).name << ", measured - simulated [" << info(m.signal).unit << "], against "
              << name_of(m.against) << " (explains " << pretty(100 * m.explained, 2) << " % of the residual)\n";
    Table table({std::string(name_of(m.against)), "mean", "", "RMSE/floor"});
    for (std::size_t b = 0; b < m.bins.size(); ++b) {
      table.row({pretty(m.bins[b], 3), pretty(m.mean[b], 3), bar(largest > 0 ? m.mean[b] / largest : 0, 40),
                 pretty(m.ratio[b], 3)});
    }
    std::cout << table.text("  ", width_of_rows());
  }
  if (shown.empty()) std::cout << "No signal is above its noise floor by more than a tenth.\n";
}

}  // namespace emtb
