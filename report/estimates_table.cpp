#include "report/estimates_table.h"

#include <nlohmann/json.hpp>

#include "hal/unit.h"
#include "report/text.h"

namespace emtb {
namespace {

using nlohmann::json;

std::string in_words(const json& number, int digits = 4) {
  return number.is_number() ? pretty(number.get<double>(), digits) : "-";
}

/// The value with as many digits as its error is worth, and its error.
std::pair<std::string, std::string> value_and_error(const json& p) {
  if (!p["value"].is_number() || !p["std_error"].is_number()) return {in_words(p["value"], 6), "-"};
  const std::string both = pretty(p["value"].get<double>(), p["std_error"].get<double>(), "");
  const auto at = both.find(" +- ");
  if (at == std::string::npos) return {both, in_words(p["std_error"], 2)};
  std::string error = both.substr(at + 4);
  while (!error.empty() && error.back() == ' ') error.pop_back();
  return {both.substr(0, at), error};
}

/// Where the model fails most, and the changes that were noticed: a line each.
std::string misfit_lines(const json& misfit) {
  std::string text;
  const json* worst = nullptr;
  std::string signal;
  double most = 1.5;  // times the noise floor, below which nobody needs to look
  for (const json& bin : misfit["where"]) {
    for (const auto& [name, times] : bin["normalised"].items()) {
      if (!times.is_number() || times.get<double>() <= most) continue;
      most = times.get<double>();
      worst = &bin;
      signal = name;
    }
  }
  if (worst != nullptr) {
    text += "fails most in " + signal + " where " + (*worst)["against"].get<std::string>() + " is " +
            in_words((*worst)["from"], 3) + " to " + in_words((*worst)["to"], 3) + ": " + pretty(most, 3) +
            " times its noise\n";
  }
  if (!misfit["points_to"].empty()) {
    text += "points to";
    for (const json& s : misfit["points_to"]) {
      text += (s == misfit["points_to"].front() ? " " : ", or ") + s["name"].get<std::string>() + " = " +
              pretty(s["change"].get<double>(), s["std_error"].get<double>(), s["unit"].get<std::string>());
    }
    text += "\n";
  }
  if (misfit["changes"].empty()) {
    text += misfit["watching"].get<bool>() ? "no change noticed\n" : "not yet watching for changes: too little seen\n";
  }
  for (const json& change : misfit["changes"]) text += "changed: " + change["text"].get<std::string>() + "\n";
  return text;
}

/// `the model does not fit: it leaves omega 5.3 times its noise. These values are not to be trusted, ...`
std::string does_not_fit(const json& left) {
  std::string name;
  double most = 0;
  for (const auto& [signal, floors] : left.items()) {
    if (!floors.is_number() || floors.get<double>() < most) continue;
    most = floors.get<double>();
    name = signal;
  }
  return "the model does not fit: what it leaves of " + name + " is " + pretty(most, 2) +
         " times the noise. These values are not to be trusted, whatever their errors say";
}

}  // namespace

std::string estimates_table(const json& now) {
  std::string text = "model " + now["model"].get<std::string>() + ", t = " + in_words(now["t"], 5) + " s, " +
                     now["samples"].dump() + " samples";
  if (now["lost"].get<std::uint64_t>() > 0)
    text += ", " + now["lost"].dump() + " readings lost: the machine is too slow";
  text += "\n";
  Table parameters({"parameter", "value", "+-", "unit", ""});
  for (const auto& [name, p] : now["parameters"].items()) {
    const auto [value, error] = value_and_error(p);
    const bool fixed = p["fixed"].get<bool>();
    parameters.row({name, value, error, shown_unit(p["unit"].get<std::string>()),
                    fixed                       ? "fixed"
                    : p["at_bound"].get<bool>() ? "at its bound: no estimate"
                    : p["excited"].get<bool>()  ? "excited"
                                                : "not excited"});
  }
  text += parameters.text();
  if (!now["fits"].get<bool>()) text += does_not_fit(now["left"]) + "\n";
  text += "\n";
  Table signals({"signal", "model", "innovation", "in noise", "unit"});
  for (const auto& [name, i] : now["innovation"].items()) {
    const auto state = now["states"].find(name);
    signals.row({name, state == now["states"].end() ? "-" : in_words((*state)["value"]), in_words(i["value"], 3),
                 in_words(i["normalised"], 3), shown_unit(i["unit"].get<std::string>())});
  }
  text += signals.text();
  text += misfit_lines(now["misfit"]);
  if (!now["left_out"].empty()) {
    text += "left out, since they repeat with an angle that is not known:";
    for (const json& id : now["left_out"]) text += " " + id.get<std::string>();
    text += "\n";
  }
  return text;
}

}  // namespace emtb
