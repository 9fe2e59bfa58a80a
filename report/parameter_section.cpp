#include "report/parameter_section.h"

#include <algorithm>
#include <cmath>

#include "figures/number.h"
#include "report/figures_of_diagnosis.h"
#include "report/gauge_words.h"
#include "report/next_steps.h"
#include "report/symbols.h"
#include "report/words.h"

namespace emtb {
namespace {

/// What a parameter is: its meaning, or the effect that brought it.
std::string meaning_of(const std::string& name) {
  if (const std::size_t dot = name.find('.'); dot != std::string::npos) return "`" + name.substr(0, dot) + "`";
  for (const BaseParameter& b : base_parameters)
    if (b.symbol == name) return std::string(b.name);
  return "";
}

std::string with_error(double value, const Parameter& p) {
  const bool free = !p.fixed && p.std_error;
  return free && !is_determined(p) ? printed(value, 2) + " (not determined)"
         : p.std_error             ? printed(value, *p.std_error)
                                   : printed(value);
}

/// Its value in a model; a dash where the model has no such parameter.
std::string value_in(const Model& model, const std::string& name) {
  const std::vector<std::string> names = model.names();
  const auto at = std::ranges::find(names, name);
  if (at == names.end()) return "–";
  const auto i = static_cast<std::size_t>(at - names.begin());
  return with_error(model.values()[i], model.at(i));
}

/// Between which values it was free to move, and what else kept it: a tie, a bound, a prior.
std::string bounds_of(const Diagnosis& d, const std::string& name, const Parameter& p) {
  const Model& model = d.final;
  const auto tie = model.tie.find(name);
  std::string remark;
  if (tie != model.tie.end()) {
    remark = "= " + symbol_of(tie->second) + " (tied)";
  } else if (p.pinned) {
    remark = "held: these runs cannot tell it";
  } else if (p.fixed) {
    remark = "fixed";
  } else if (std::ranges::find(d.at_bound, name) != d.at_bound.end()) {
    remark = "rests on its bound";
  } else if (p.prior) {
    remark = "prior " + printed(p.prior->value, p.prior->std);
  }
  if (const auto with = scaled_with(d.pins, tie != model.tie.end() ? tie->second : name); !with.empty()) {
    std::vector<std::string> symbols;
    for (const std::string& pin : with) symbols.push_back(symbol_of(pin));
    remark += (remark.empty() ? "goes with " : ", goes with ") + joined(symbols);
  }
  const bool free = !p.fixed && tie == model.tie.end();
  std::string bounds = free ? printed(p.min) + " … " + printed(p.max) : "";
  if (!remark.empty()) bounds.append(bounds.empty() ? "" : "; ").append(remark);
  return bounds;
}

std::vector<std::vector<std::string>> parameter_rows(const Diagnosis& d) {
  std::vector<std::vector<std::string>> rows;
  const std::vector<std::string> names = d.final.names();
  const std::vector<double> values = d.final.values();
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (d.final.input == Signal::i_a && (i == base::R_a || i == base::K_b)) continue;  // not in its equations
    const Parameter& p = d.final.at(i);
    std::string interval = "–";
    if (p.std_error && is_determined(p) && !d.final.tie.contains(names[i]))
      interval = printed_range(values[i] - normal_95 * *p.std_error, values[i] + normal_95 * *p.std_error);
    const std::size_t dot = names[i].find('.');
    rows.push_back({symbol_of(names[i].substr(dot == std::string::npos ? 0 : dot + 1)), meaning_of(names[i]),
                    value_in(d.base, names[i]), with_error(values[i], p), interval, printed_unit(p.unit),
                    bounds_of(d, names[i], p)});
  }
  return rows;
}

}  // namespace

void parameter_section(Page& page, const Diagnosis& d) {
  page.section("Parameters");
  page.table("Values ± standard errors, which hold for correlated residuals too (block sandwich)", "llrrrll",
             {"", "parameter", "base model", "final model", "95 % interval", "unit", "bounds"}, parameter_rows(d));
  page.figure(parameter_figure(d));
  for (const Pin& pin : d.pins) page.paragraph(in_words(pin, Names::on_a_page));
  if (d.undetermined.empty()) {
    page.paragraph(d.pins.empty() ? "These runs determine every free parameter of the final model."
                                  : "With that these runs determine every other parameter of the final model.");
    return;
  }
  std::vector<std::string> items;
  for (const Undetermined& u : d.undetermined)
    items.push_back(combination(u) + ": " +
                    (u.relative_error < 100 ? "±" + printed(100 * u.relative_error, 2) + " %"
                                            : std::string("anything fits as well")));
  page.paragraph("These runs do not determine, in relative changes:").list(items);
}

}  // namespace emtb
