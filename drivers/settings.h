#pragma once

#include <string_view>
#include <utility>
#include <vector>

#include "config/yaml.h"
#include "drivers/line_settings.h"
#include "hal/input_device.h"
#include "hal/signal.h"

/// What several drivers read alike of their entry in a bench file. Each throws ConfigError with file, line and key.
namespace emtb {

int whole_number(const YamlMap& yaml, std::string_view key, int min, int max, int fallback);

/// `scale`: anything but 0; 1 where it is absent.
double read_scale(const YamlMap& yaml);

/// How a device's number becomes a reading, as `unit`, `scale`, `offset`, `resolution` and `range` say: reading =
/// (scale · number + offset) in the unit, which is the signal's own where none is given.
struct Scaling {
  double unit = 1;    ///< SI of one of the unit
  double zero = 0;    ///< SI of its zero
  double scale = 1;   ///< SI of one of the device's number
  double offset = 0;  ///< SI
  double digit = 0;   ///< SI of the last digit; 0: unknown
  double range = 0;   ///< SI of the largest reading, of either sign; 0: unknown

  /// For Channel::conversion. @param raw what the device counts in
  Conversion conversion(std::string_view raw) const {
    return {.scale = scale, .offset = offset, .unit = raw, .from_file = true, .file_unit = unit, .file_zero = zero};
  }
};

Scaling read_scaling(Signal signal, const YamlMap& yaml);

/// The signal of that name, of those that a device may measure. @param key where the complaint about any other points
Signal measured_signal(const YamlMap& yaml, const std::string& key, const std::string& name);

/// `line: 9600 8N1`, over what is usual. @param example for the complaint
LineSettings read_line_key(const YamlMap& yaml, const LineSettings& usual, std::string_view example);

/// The entries of `channels` of a card that sees voltages, one at least, in the file's order.
std::vector<std::pair<Signal, YamlMap>> voltage_channels(const YamlMap& device);

/// `scale` of such an entry: how many of the signal's unit is one volt? Only a voltage may go without.
double read_volts_scale(Signal signal, const YamlMap& channel);

}  // namespace emtb
