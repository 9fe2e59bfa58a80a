#include "drivers/comedi/open.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "drivers/scanning_card.h"
#include "drivers/settings.h"

namespace emtb::comedi {
namespace {

constexpr double lowest_rate = 1;     // [Hz]
constexpr double fastest_scan = 1e6;  // [Hz] of all channels together; the card's driver says what it can do
constexpr double usual_range = 10;    // [V] of either sign
constexpr int most_channels = 256;    // that an entry of a channel list can name

unsigned int channel_number(const YamlMap& yaml) {
  return static_cast<unsigned int>(whole_number(yaml, "channel", 0, most_channels - 1, 0));
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
  entry.channel = channel_number(yaml);
  const std::string wiring = yaml.text_or("wiring", "single_ended");
  if (wiring != "single_ended" && wiring != "differential" && wiring != "common") {
    yaml.fail("wiring", "is `" + wiring + "`. Known: single_ended, differential, common (against AISENSE)");
  }
  entry.wiring = wiring == "differential" ? Wiring::differential
                 : wiring == "common"     ? Wiring::common
                                          : Wiring::single_ended;
  entry.wanted = read_range(yaml);
  entry.scale = read_volts_scale(signal, yaml);
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
  for (const auto& [signal, entry] : voltage_channels(device)) settings.channels.push_back(read_channel(signal, entry));
  const double most = std::floor(fastest_scan / static_cast<double>(settings.channels.size()));
  settings.rate = device.within_or("rate", lowest_rate, most, rate);
  return settings;
}

OutputSettings read_output(const BenchConfig::Reference& reference, const CardSettings& card) {
  reference.yaml.only({"device", "min", "max", "safe", "safe_because", "rate", "channel", "read_back"});
  return {.card = card,
          .channel = channel_number(reference.yaml),
          .limits = reference.limits,
          .read_back = reference.yaml.flag_or("read_back", true)};
}

OpenedDevice open_card(const OpenRequest& request) {
  return open_scanning_card<Inputs, OutputConverter>(request, read_settings, read_output);
}

void check_card(const OpenRequest& request) { check_scanning_card(request, read_settings, read_output); }

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
