#include "report/gauge_words.h"

#include <algorithm>
#include <cmath>

#include "hal/unit.h"
#include "report/symbols.h"
#include "report/text.h"
#include "report/words.h"

namespace emtb {
namespace {

/// `T_c` of `coulomb_friction.T_c`.
std::string short_of(const std::string& parameter, Names names) {
  const std::size_t dot = parameter.find('.');
  const std::string own = dot == std::string::npos ? parameter : parameter.substr(dot + 1);
  return names == Names::on_a_page ? symbol_of(own) : own;
}

/// `J R_a` of a J that goes as 1/R_a, `B/J` of a B that goes as J; empty where the power is no whole number.
std::string composite_of(const Follower& follower, const std::string& pin, Names names) {
  constexpr double whole = 0.05;  // as near to a whole number as the sizes of a fit are to each other; by hand
  const double power = std::round(follower.power);
  if (std::abs(follower.power - power) > whole || power == 0) return {};
  const std::string name = short_of(follower.parameter, names), degree = pretty(std::abs(power));
  const std::string base = std::abs(power) == 1 ? pin : pin + "^" + degree;
  return power < 0 ? name + " " + base : name + "/" + base;
}

/// What the runs tell in the place of the parameter that is held.
std::string told_instead(const Pin& pin, Names how) {
  if (pin.followers.empty()) return "these runs tell nothing of it";
  const bool adds = pin.value == 0;  // what is held at nothing is told from none by a factor
  std::vector<std::string> composites, names;
  for (const Follower& f : pin.followers) {
    composites.push_back(composite_of(f, short_of(pin.parameter, how), how));
    names.push_back(short_of(f.parameter, how));
  }
  if (!adds && std::ranges::find(composites, "") == composites.end())
    return "these runs tell " + joined(composites) + " only";
  return "these runs do not tell it from " + joined(names, " and ");
}

bool mentions(const Undetermined& u, const std::string& name) {
  return (" " + u.combination + " ").find(" " + name + " ") != std::string::npos;
}

/// The parameter of a combination that is the easiest to know from elsewhere.
std::string easiest_to_fix(std::span<const Undetermined> undetermined) {
  for (const std::size_t place : {base::R_a, base::K_m, base::J, base::K_b, base::B}) {
    const std::string name(base_parameters[place].symbol);
    if (std::ranges::any_of(undetermined, [&](const Undetermined& u) { return mentions(u, name); })) return name;
  }
  return "one of them";
}

}  // namespace

std::string in_words(const Pin& pin, Names names) {
  const std::string held = short_of(pin.parameter, names),
                    unit = names == Names::on_a_page ? printed_unit(pin.unit) : pin.unit;
  const std::string where = !pin.current_read && !pin.followers.empty() ? "without a measured current " : "";
  const std::string current = names == Names::on_a_page ? symbol_of(Signal::i_a) : "i_a";
  return held + " is held at " + pretty(pin.value) + with_space(unit) + ": " + where + told_instead(pin, names) +
         ". To tell it, " + (pin.current_read ? "" : "measure " + current + ", or ") +
         "give the model what is known of " + held + " (fixed: true, or prior: {value, std}).";
}

Recorded recorded_by(std::span<const Record> records) {
  Recorded r;
  for (const Record& record : records) {
    r.current = r.current || record.find(Signal::i_a) != nullptr;
    r.torque = r.torque || record.measured_load;
  }
  return r;
}

std::string advice_on(std::span<const Undetermined> undetermined, const Model& model, const Recorded& recorded) {
  const std::string fix = "fix " + easiest_to_fix(undetermined) + " (fixed: true, or prior: {value, std})";
  const auto open = [&](std::size_t place) {
    const std::string name(base_parameters[place].symbol);
    return std::ranges::any_of(undetermined, [&](const Undetermined& u) { return mentions(u, name); });
  };
  const bool of_the_base = open(base::R_a) || open(base::K_b) || open(base::K_m) || open(base::J) || open(base::B);
  if (of_the_base && model.input != Signal::i_a && !recorded.current) return fix + ", or measure i_a";
  if (open(base::K_m) && !model.tie.contains("K_m") && !recorded.torque)
    return "tie K_m to K_b (tie: {K_m: K_b}), or record a torque that varies";
  const std::string record = "record runs that move it: a coast-down, a reversal, a staircase to full speed";
  return of_the_base ? fix + ", or " + record : record;
}

std::string in_words(const Undetermined& u) {
  constexpr double anything = 100;  // times its size
  const bool alone = u.combination.starts_with("+1.00 ");
  const std::string what = alone ? u.combination.substr(6) : u.combination + " (relative changes)";
  if (!(u.relative_error < anything)) return "These data do not determine " + what + ": anything fits as well";
  return "These data do not determine " + what + ": +-" + pretty(100 * u.relative_error, 2) + " %";
}

bool is_determined(const Parameter& p) {
  constexpr double nothing = 10, no_error = 1e-9;  // of the value
  if (!p.std_error || !std::isfinite(*p.std_error)) return false;
  const double size = std::abs(p.value);
  if (size == 0) return *p.std_error > 1e-30;  // what is fitted to nothing may well be known to be nothing
  return *p.std_error<nothing * size&& * p.std_error> no_error * size;
}

std::string error_in_words(const Parameter& p, bool free) {
  if (!free) return "-";
  return is_determined(p) ? pretty(*p.std_error, 2) : "not determined";
}

}  // namespace emtb
