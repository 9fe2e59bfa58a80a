#include "drivers/settings.h"

#include <cmath>
#include <string>

#include "session/units.h"

namespace emtb {

int whole_number(const YamlMap& yaml, std::string_view key, int min, int max, int fallback) {
  const double value = yaml.within_or(key, min, max, fallback);
  if (value != std::floor(value)) yaml.fail(key, "must be a whole number");
  return static_cast<int>(value);
}

double read_scale(const YamlMap& yaml) {
  const double scale = yaml.number_or("scale", 1);
  if (scale == 0) yaml.fail("scale", "is 0: every reading would be the same");
  return scale;
}

Scaling read_scaling(Signal signal, const YamlMap& yaml) {
  const std::string unit = yaml.text_or("unit", info(signal).unit);
  const auto conversion = unit_of(signal, unit);
  if (!conversion) yaml.fail("unit", "is `" + unit + "`. Known: " + known_units(signal));
  Scaling scaling{.unit = conversion->scale, .zero = conversion->offset};
  scaling.scale = scaling.unit * read_scale(yaml);
  scaling.offset = scaling.unit * yaml.number_or("offset", 0) + scaling.zero;
  if (yaml.has("resolution")) scaling.digit = std::abs(scaling.unit) * yaml.positive("resolution");
  if (yaml.has("range")) scaling.range = std::abs(scaling.unit) * yaml.positive("range");
  return scaling;
}

Signal measured_signal(const YamlMap& yaml, const std::string& key, const std::string& name) {
  const auto signal = signal_named(name);
  if (!signal || *signal == Signal::u_ref || *signal == Signal::armature_open) {
    yaml.fail(key, (key == name ? "cannot be measured here" : "is `" + name + "`") +
                       ". A device may give e_a, i_a, omega, theta, torque, i_f, temperature");
  }
  return *signal;
}

LineSettings read_line_key(const YamlMap& yaml, const LineSettings& usual, std::string_view example) {
  if (!yaml.has("line")) return usual;
  const std::string text = yaml.text("line");
  const auto line = read_line(text, usual);
  if (!line) yaml.fail("line", "is `" + text + "`. Write baud, bits, parity, stop bits: " + std::string(example));
  return *line;
}

std::vector<std::pair<Signal, YamlMap>> voltage_channels(const YamlMap& device) {
  const YamlMap entries = device.map("channels");
  std::vector<std::pair<Signal, YamlMap>> channels;
  for (const auto& [name, entry] : entries.entries()) {
    const auto signal = signal_named(name);
    if (!signal || *signal == Signal::theta || *signal == Signal::armature_open) {
      entries.fail(name, "is no voltage. The card may give u_ref, e_a, i_a, omega, torque, i_f, temperature");
    }
    channels.emplace_back(*signal, entry);
  }
  if (channels.empty()) device.fail("channels", "is empty. Give at least one signal");
  return channels;
}

double read_volts_scale(Signal signal, const YamlMap& channel) {
  if (signal != Signal::u_ref && signal != Signal::e_a && !channel.has("scale")) {
    channel.fail("scale", "is missing: how many " + std::string(info(signal).unit) + " is one volt at the card?");
  }
  return read_scale(channel);
}

}  // namespace emtb
