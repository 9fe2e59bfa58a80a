#include "config/parameter.h"

#include <array>
#include <charconv>
#include <cmath>

#include "hal/unit.h"

namespace emtb {

std::string yaml_number(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 9).ptr;
  return {text.data(), end};
}

Parameter read_parameter(const YamlMap& parent, const std::string& symbol, std::string_view unit, double least,
                         double most) {
  const YamlMap yaml = parent.map(symbol);
  yaml.only({"value", "min", "max", "unit", "fixed", "prior", "std_error"});
  const std::string given = yaml.text_or("unit", unit);
  if (given != unit) yaml.fail("unit", "is `" + given + "`, but " + symbol + " is in " + std::string(unit));
  return read_parameter_body(yaml, symbol, given, least, most);
}

Parameter read_parameter_body(const YamlMap& yaml, const std::string& symbol, const std::string& unit, double least,
                              double most) {
  Parameter p;
  p.symbol = symbol;
  p.unit = unit;
  p.value = yaml.number("value");
  p.fixed = yaml.flag_or("fixed", false);
  p.min = p.fixed ? yaml.number_or("min", p.value) : yaml.number_or("min", least);
  p.max = p.fixed ? yaml.number_or("max", p.value) : yaml.number_or("max", most);
  if (!p.fixed && (!std::isfinite(p.min) || !std::isfinite(p.max))) {
    yaml.fail("", "needs min and max (or fixed: true): a fit moves it within them");
  }
  if (p.min < least) yaml.fail("min", "is below " + yaml_number(least) + with_space(p.unit) + ", which cannot be");
  if (p.max < p.min) yaml.fail("max", "is below min");
  if (p.value < p.min || p.value > p.max) {
    yaml.fail("value", "is " + yaml_number(p.value) + with_space(p.unit) + ", outside its bounds " +
                           yaml_number(p.min) + " to " + yaml_number(p.max) + ". Start within them, or widen them");
  }
  if (const auto prior = yaml.map_if("prior")) {
    prior->only({"value", "std"});
    p.prior = Prior{prior->number("value"), prior->positive("std")};
  }
  if (yaml.has("std_error")) p.std_error = yaml.number("std_error");
  return p;
}

void write_parameter(YAML::Emitter& out, const Parameter& p, double null) {
  out << YAML::Key << p.symbol << YAML::Value << YAML::Flow << YAML::BeginMap;
  out << YAML::Key << "value" << YAML::Value << yaml_number(p.value);
  if (p.fixed && !p.pinned) {  // what a diagnosis held is as free as it was
    out << YAML::Key << "fixed" << YAML::Value << true;
  } else {
    out << YAML::Key << "min" << YAML::Value << yaml_number(p.min) << YAML::Key << "max" << YAML::Value
        << yaml_number(p.max);
  }
  if (p.prior) {
    out << YAML::Key << "prior" << YAML::Value << YAML::BeginMap << YAML::Key << "value" << YAML::Value
        << yaml_number(p.prior->value) << YAML::Key << "std" << YAML::Value << yaml_number(p.prior->std)
        << YAML::EndMap;
  }
  if (null != 0) out << YAML::Key << "null" << YAML::Value << yaml_number(null);
  if (p.std_error) out << YAML::Key << "std_error" << YAML::Value << yaml_number(*p.std_error);
  out << YAML::Key << "unit" << YAML::Value << p.unit << YAML::EndMap;
}

}  // namespace emtb
