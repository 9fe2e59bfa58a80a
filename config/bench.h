#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "config/yaml.h"
#include "hal/analog_output.h"

namespace emtb {

/// How hard the loop insists on real time: fail without it, try it, or do not.
enum class Realtime { require, prefer, off };

/// A bench file, checked: `config/benches/NAME.yaml`. Driver settings stay YAML; the driver that they name reads them.
struct BenchConfig {
  /// The reference output: which device drives it, within what limits.
  struct Reference {
    std::string device;  ///< a name among `devices`
    Limits limits;       ///< [V]
    double rate = 0;     ///< [V/s] largest change of the reference; 0: unlimited
    YamlMap yaml;        ///< the entry itself, for the driver's own keys (channel ...)
  };

  /// Beyond these the loop latches. Absent: not checked.
  struct SafetyLimits {
    std::optional<double> omega;   ///< [rad/s], of either sign
    std::optional<double> i_a;     ///< [A]
    std::optional<double> torque;  ///< [N m]
    std::optional<double> time;    ///< [s] longest run
  };

  struct Device {
    std::string name;
    std::string driver;  ///< found by name in drivers/
    YamlMap yaml;
  };

  std::string name;
  double rate = 1000;  ///< [Hz]
  Realtime realtime = Realtime::prefer;
  Reference reference;
  SafetyLimits limits;
  std::vector<Device> devices;
  std::optional<YamlMap> simulation;  ///< the plant behind simulated devices; only drivers/simulated reads it
  std::string text;                   ///< the whole file, for the session
  std::filesystem::path file;
};

/// @throws ConfigError with file, line and key.
BenchConfig read_bench(const std::filesystem::path& path);

}  // namespace emtb
