#include "drivers/serial_meter/open.h"

#include <algorithm>
#include <array>
#include <sstream>

#include "drivers/settings.h"

namespace emtb::serial_meter {
namespace {

constexpr std::array functions{
    Function{"dc_current", Quantity::current, Coupling::dc, "A"},
    Function{"ac_current", Quantity::current, Coupling::ac, "A"},
    Function{"acdc_current", Quantity::current, Coupling::ac_and_dc, "A"},
    Function{"current", Quantity::current, Coupling::unsaid, "A"},
    Function{"dc_voltage", Quantity::voltage, Coupling::dc, "V"},
    Function{"ac_voltage", Quantity::voltage, Coupling::ac, "V"},
    Function{"acdc_voltage", Quantity::voltage, Coupling::ac_and_dc, "V"},
    Function{"voltage", Quantity::voltage, Coupling::unsaid, "V"},
    Function{"resistance", Quantity::resistance, Coupling::unsaid, "ohm"},
    Function{"frequency", Quantity::frequency, Coupling::unsaid, "Hz"},
    Function{"temperature", Quantity::temperature, Coupling::unsaid, "degC"},
};

template <class List>
std::string names_of(const List& list) {
  std::string names;
  for (const auto& one : list) names += (names.empty() ? "" : ", ") + std::string(one.name);
  return names;
}

const Model& read_model(const YamlMap& device) {
  const std::string name = device.text("model");
  const Model* model = model_named(name);
  if (model == nullptr) device.fail("model", "is `" + name + "`. Known: " + names_of(models()));
  return *model;
}

Function read_function(const YamlMap& device, Signal signal) {
  std::string name = signal == Signal::i_a || signal == Signal::i_f ? "dc_current"
                     : signal == Signal::e_a                        ? "dc_voltage"
                     : signal == Signal::temperature                ? "temperature"
                                                                    : "";
  if (name.empty() && !device.has("function")) {
    device.fail("function", "is missing: what does the meter measure of " + std::string(info(signal).name) +
                                "? Known: " + names_of(functions));
  }
  name = device.text_or("function", name);
  const auto found = std::ranges::find(functions, name, &Function::name);
  if (found == functions.end()) device.fail("function", "is `" + name + "`. Known: " + names_of(functions));
  if (found->unit != info(signal).unit && !device.has("scale")) {
    device.fail("scale", "is missing: how many " + std::string(info(signal).unit) + " of " +
                             std::string(info(signal).name) + " is one " + std::string(found->unit) + "?");
  }
  return *found;
}

std::string text_of(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

/// The last digit in the range that the bench file names, in the function's unit; 0: unknown.
double digit_in_range(const YamlMap& device, const Model& model, const Function& function, double range) {
  double largest = 0;
  const Range* fitting = nullptr;
  for (const Range& one : model.ranges) {
    if (one.quantity != function.quantity) continue;
    largest = std::max(largest, one.full_scale);
    if (one.full_scale >= range * (1 - 1e-9) && (fitting == nullptr || one.full_scale < fitting->full_scale))
      fitting = &one;
  }
  if (largest > 0 && fitting == nullptr) {
    device.fail("range", "is " + text_of(range) + " " + std::string(function.unit) + ", but the " +
                             std::string(model.maker) + " goes to " + text_of(largest));
  }
  return fitting == nullptr ? 0 : fitting->digit;
}

/// In the function's unit; 0: unknown.
double largest_range(const Model& model, const Function& function) {
  double largest = 0;
  for (const Range& one : model.ranges) {
    if (one.quantity == function.quantity) largest = std::max(largest, one.full_scale);
  }
  return largest;
}

}  // namespace

LineSettings read_line_settings(const YamlMap& device, const LineSettings& usual) {
  LineSettings line = read_line_key(device, usual, "9600 8N1");
  line.dtr = device.flag_or("dtr", line.dtr);
  line.rts = device.flag_or("rts", line.rts);
  return line;
}

MeterSettings read_settings(const YamlMap& device) {
  device.only({"driver", "port", "model", "signal", "function", "scale", "offset", "range", "resolution", "period",
               "window", "latency", "timeout", "line", "dtr", "rts"});
  const Model& model = read_model(device);
  MeterSettings settings{
      .port = device.text("port"),
      .model = std::shared_ptr<const Model>(std::shared_ptr<void>(), &model),  // one of models(): nobody's
      .line = read_line_settings(device, model.line)};
  settings.signal = measured_signal(device, "signal", device.text_or("signal", "i_a"));
  settings.function = read_function(device, settings.signal);
  settings.scale = read_scale(device);
  settings.offset = device.number_or("offset", 0);
  if (device.has("range")) {
    settings.range = device.positive("range");
    settings.digit = std::abs(settings.scale) * digit_in_range(device, model, settings.function, settings.range);
  }
  const double full_scale = device.has("range") ? settings.range : largest_range(model, settings.function);
  settings.reach = std::abs(settings.scale) * full_scale;
  settings.digit = device.within_or("resolution", 0, unbounded, settings.digit);
  settings.period = device.has("period") ? device.positive("period") : model.period;
  settings.window = device.within_or("window", 0, settings.period, std::min(model.window, settings.period));
  settings.latency = device.within_or("latency", 0, unbounded, 0);
  settings.timeout = device.has("timeout") ? device.positive("timeout") : std::max(1.5, 3 * settings.period);
  const Protocol& protocol = *model.protocol;
  if (protocol.set_up != nullptr && protocol.set_up(settings.function, settings.range, model.line_cycles).empty()) {
    device.fail("function", "is `" + std::string(settings.function.name) + "`, which the " + std::string(model.maker) +
                                " does not have");
  }
  return settings;
}

OpenedDevice open_meter(const OpenRequest& request) { return open_input<Meter>(request, read_settings); }

}  // namespace emtb::serial_meter
