#include "drivers/usb1608g/open.h"

#include <cmath>

#include "drivers/scanning_card.h"
#include "drivers/settings.h"

namespace emtb::usb1608g {
namespace {

constexpr double output_full_scale = 10;  // [V] of either sign
constexpr double fastest_scan = 500e3;    // [Hz] of the fastest card, with one channel
constexpr double lowest_rate = 1;         // [Hz]

InputChannel read_channel(Signal signal, const YamlMap& yaml) {
  yaml.only({"channel", "wiring", "range", "scale", "offset"});
  InputChannel entry{.signal = signal, .slot = {}};
  const std::string wiring = yaml.text_or("wiring", "single_ended");
  if (wiring != "single_ended" && wiring != "differential") {
    yaml.fail("wiring", "is `" + wiring + "`. Known: single_ended, differential");
  }
  entry.slot.wiring = wiring == "differential" ? Wiring::differential : Wiring::single_ended;
  if (!yaml.has("channel")) yaml.fail("channel", "is missing");
  entry.slot.channel = whole_number(yaml, "channel", 0, channels_of(entry.slot.wiring) - 1, 0);
  const auto range = range_of(yaml.number_or("range", ranges[0]));
  if (!range) yaml.fail("range", "is not one of the card's: 10, 5, 2 or 1 V, of either sign");
  entry.slot.range = *range;
  entry.scale = read_volts_scale(signal, yaml);
  entry.offset = yaml.number_or("offset", 0);
  return entry;
}

CardSettings read_card(const YamlMap& device) {
  CardSettings card{.serial = device.text_or("serial", ""), .fpga = device.text_or("fpga", "")};
  const std::string calibration = device.text_or("calibration", "card");
  if (calibration != "card" && calibration != "nominal") {
    device.fail("calibration", "is `" + calibration + "`. Known: card (what its memory holds), nominal");
  }
  card.calibrated = calibration == "card";
  return card;
}

}  // namespace

InputSettings read_settings(const YamlMap& device, double rate) {
  device.only({"driver", "serial", "fpga", "calibration", "rate", "latency", "pacer", "start_bytes", "channels"});
  InputSettings settings{.card = read_card(device), .channels = {}};
  for (const auto& [signal, entry] : voltage_channels(device)) settings.channels.push_back(read_channel(signal, entry));
  const auto count = static_cast<double>(settings.channels.size());
  settings.rate = device.within_or("rate", lowest_rate, std::floor(fastest_scan / count), rate);
  settings.latency = device.within_or("latency", 0, 0.1, settings.latency);
  const std::string pacer = device.text_or("pacer", "scan");
  if (pacer != "scan" && pacer != "conversion") device.fail("pacer", "is `" + pacer + "`. Known: scan, conversion");
  settings.pacer = pacer == "scan" ? Pacer::scan : Pacer::conversion;
  settings.start_length = whole_number(device, "start_bytes", 14, 15, 15);
  return settings;
}

OutputSettings read_output(const BenchConfig::Reference& reference, const CardSettings& card) {
  reference.yaml.only({"device", "min", "max", "safe", "safe_because", "rate", "channel", "read_back"});
  reference.yaml.within("min", -output_full_scale, output_full_scale);
  reference.yaml.within("max", -output_full_scale, output_full_scale);
  return {.card = card,
          .channel = whole_number(reference.yaml, "channel", 0, 1, 0),
          .limits = reference.limits,
          .read_back = reference.yaml.flag_or("read_back", true)};
}

OpenedDevice open_card(const OpenRequest& request) {
  return open_scanning_card<Inputs, Converter>(request, read_settings, read_output);
}

void check_card(const OpenRequest& request) { check_scanning_card(request, read_settings, read_output); }

}  // namespace emtb::usb1608g
