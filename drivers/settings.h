#pragma once

#include <string_view>
#include <utility>
#include <vector>

#include "config/yaml.h"
#include "drivers/line_settings.h"
#include "hal/signal.h"

/// What several drivers read alike of their entry in a bench file. Each throws ConfigError with file, line and key.
namespace emtb {

int whole_number(const YamlMap& yaml, std::string_view key, int min, int max, int fallback);

/// `scale`: anything but 0; 1 where it is absent.
double read_scale(const YamlMap& yaml);

/// `line: 9600 8N1`, over what is usual. @param example for the complaint
LineSettings read_line_key(const YamlMap& yaml, const LineSettings& usual, std::string_view example);

/// The entries of `channels` of a card that sees voltages, one at least, in the file's order.
std::vector<std::pair<Signal, YamlMap>> voltage_channels(const YamlMap& device);

/// `scale` of such an entry: how many of the signal's unit is one volt? Only a voltage may go without.
double read_volts_scale(Signal signal, const YamlMap& channel);

}  // namespace emtb
