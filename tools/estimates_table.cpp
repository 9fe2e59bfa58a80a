#include "tools/estimates_table.h"

#include <nlohmann/json.hpp>

#include "tools/text.h"

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
    parameters.row({name, value, error, p["unit"].get<std::string>(),
                    fixed                      ? "fixed"
                    : p["excited"].get<bool>() ? "excited"
                                               : "not excited"});
  }
  text += parameters.text() + "\n";
  Table signals({"signal", "model", "innovation", "in noise", "unit"});
  for (const auto& [name, i] : now["innovation"].items()) {
    const auto state = now["states"].find(name);
    signals.row({name, state == now["states"].end() ? "-" : in_words((*state)["value"]), in_words(i["value"], 3),
                 in_words(i["normalised"], 3), i["unit"].get<std::string>()});
  }
  text += signals.text();
  if (!now["left_out"].empty()) {
    text += "left out, since they repeat with an angle that is not known:";
    for (const json& id : now["left_out"]) text += " " + id.get<std::string>();
    text += "\n";
  }
  return text;
}

}  // namespace emtb
