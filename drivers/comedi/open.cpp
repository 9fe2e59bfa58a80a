#include "drivers/comedi/open.h"

#include <algorithm>
#include <cctype>
#include <cmath>

namespace emtb::comedi {
namespace {

constexpr double lowest_rate = 1;     // [Hz]
constexpr double fastest_scan = 1e6;  // [Hz] of all channels together; the card's driver says what it can do
constexpr double usual_range = 10;    // [V] of either sign
constexpr int most_channels = 256;    // that an entry of a channel list can name

unsigned int channel_number(const YamlMap& yaml, double fallback) {
  const double value = yaml.within_or("channel", 0, most_channels - 1, fallback);
  if (value != std::floor(value)) yaml.fail("channel", "must be a whole number");
  return static_cast<unsigned int>(value);
}

/// `range: 10` for -10 to 10 V, or `range: [0, 10]`.
Range read_range(const YamlMap& yaml) {
  if (yaml.has("range") && yaml.node()["range"].IsSequence()) {
    const std::vector<double> ends = yaml.numbers("range");
    if (ends.size() != 2 || ends[0] >= ends[1]) yaml.fail("range", "must be [lowest, highest] in V, or one number");
    return {.min = ends[0], .max = ends[1]};
  }
  const double reach = yaml.has("range") ? yaml.positive("range") : usual_range;
  return {.min = -reach, .max = reach};
}

InputChannel read_channel(Signal signal, const YamlMap& yaml) {
  yaml.only({"channel", "wiring", "range", "scale", "offset"});
  InputChannel entry;
  entry.signal = signal;
  if (!yaml.has("channel")) yaml.fail("channel", "is missing");
  entry.channel = channel_number(yaml, 0);
  const std::string wiring = yaml.text_or("wiring", "single_ended");
  if (wiring != "single_ended" && wiring != "differential" && wiring != "common") {
    yaml.fail("wiring", "is `" + wiring + "`. Known: single_ended, differential, common (against AISENSE)");
  }
  entry.wiring = wiring == "differential" ? Wiring::differential
                 : wiring == "common"     ? Wiring::common
                                          : Wiring::single_ended;
  entry.wanted = read_range(yaml);
  if (signal != Signal::u_ref && signal != Signal::e_a && !yaml.has("scale")) {
    yaml.fail("scale", "is missing: how many " + std::string(info(signal).unit) + " is one volt at the card?");
  }
  entry.scale = yaml.number_or("scale", 1);
  if (entry.scale == 0) yaml.fail("scale", "is 0: every reading would be the same");
  entry.offset = yaml.number_or("offset", 0);
  return entry;
}

}  // namespace

InputSettings read_settings(const YamlMap& device, double rate) {
  device.only({"driver", "device", "board", "calibration", "rate", "channels"});
  InputSettings settings;
  settings.card = {.node = device.text_or("device", settings.card.node),
                   .board = device.text_or("board", ""),
                   .calibration = device.text_or("calibration", "auto")};
  const YamlMap entries = device.map("channels");
  for (const auto& [name, entry] : entries.entries()) {
    const auto signal = signal_named(name);
    if (!signal || *signal == Signal::theta || *signal == Signal::armature_open) {
      entries.fail(name, "is no voltage. The card may give u_ref, e_a, i_a, omega, torque, i_f, temperature");
    }
    settings.channels.push_back(read_channel(*signal, entry));
  }
  if (settings.channels.empty()) device.fail("channels", "is empty. Give at least one signal");
  const double most = std::floor(fastest_scan / static_cast<double>(settings.channels.size()));
  settings.rate = device.within_or("rate", lowest_rate, most, rate);
  return settings;
}

OutputSettings read_output(const BenchConfig::Reference& reference, const CardSettings& card) {
  reference.yaml.only({"device", "min", "max", "safe", "rate", "channel", "read_back"});
  return {.card = card,
          .channel = channel_number(reference.yaml, 0),
          .limits = reference.limits,
          .read_back = reference.yaml.flag_or("read_back", true)};
}

OpenedDevice open_card(const OpenRequest& request) {
  request.need_real_time();
  const InputSettings input = read_settings(request.device.yaml, request.bench.rate);
  OpenedDevice opened;
  // The output first: whatever else may be wrong with the card, the reference is safe by then.
  if (request.drives_reference()) {
    opened.output = std::make_unique<Output>(request.device.name, read_output(request.bench.reference, input.card));
  }
  if (request.output_only) return opened;
  opened.input = std::make_unique<Input>(request.device.name, request.clock, input);
  return opened;
}

std::vector<std::pair<std::string, std::string>> connected_cards(const std::filesystem::path& dev) {
  std::vector<std::pair<std::string, std::string>> cards;
  constexpr std::string_view stem = "comedi";
  std::error_code absent;
  for (std::filesystem::directory_iterator at(dev, absent), end; !absent && at != end; at.increment(absent)) {
    const std::string name = at->path().filename().string();
    const bool numbered = name.size() > stem.size() && name.starts_with(stem) &&
                          std::all_of(name.begin() + stem.size(), name.end(),
                                      [](unsigned char c) { return std::isdigit(c) != 0; });  // not comedi0_subd0
    if (!numbered) continue;
    std::string board;
    try {
      board = Link({.node = at->path().string(), .board = "", .calibration = "nominal"}).board();
    } catch (const DeviceError&) {  // a node without a card: the kernel may keep four of them
    }
    cards.emplace_back(at->path().string(), board);
  }
  std::ranges::sort(cards);
  return cards;
}

}  // namespace emtb::comedi
