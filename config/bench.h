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
    std::string device;        ///< a name among `devices`
    Limits limits;             ///< [V]
    double rate = 0;           ///< [V/s] largest change of the reference; 0: unlimited
    std::string safe_because;  ///< why safe is not the allowed value nearest 0 V (config/guards.h)
    YamlMap yaml;              ///< the entry itself, for the driver's own keys (channel ...)
  };

  /// Beyond these the loop latches. Absent: not checked.
  struct SafetyLimits {
    std::optional<double> omega{};   ///< [rad/s], of either sign
    std::optional<double> i_a{};     ///< [A]
    std::optional<double> torque{};  ///< [N m]
    std::optional<double> time{};    ///< [s] longest run
  };

  /// What the nameplate or an ohmmeter says of driver and motor: for checks, no model. Absent: not known.
  struct Nameplate {
    std::optional<double> R_a;          ///< [ohm]
    std::optional<double> K_b;          ///< [V s/rad]
    std::optional<double> driver_gain;  ///< [V/V] e_a / u_ref
  };

  /// A tacho is dead or reversed where the back-EMF e_a - R_a i_a contradicts it for so long.
  struct Tacho {
    double emf = 0;    ///< [V] beyond which the motor turns for certain, errors of R_a i_a included
    double omega = 0;  ///< [rad/s] below which the tacho says that it stands
    double time = 1;   ///< [s]
  };

  /// The guided first spin.
  struct Spin {
    double u_ref = 0;         ///< [V] the larger of its two levels; 0: a sixth of the reference's max
    double hold = 6;          ///< [s] of each level
    double tolerance = 0.25;  ///< by which voltage and speed may differ from the nameplate's
  };

  /// The live estimates.
  struct Estimates {
    std::filesystem::path model;  ///< the model's file that they begin with
    double rate = 10;             ///< [Hz] of new ones
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
  std::optional<double> field_min;  ///< [A] of i_f, without which nothing may turn; absent: not proved
  Nameplate motor;
  std::optional<Tacho> tacho;  ///< then motor.R_a is there
  Spin spin;
  std::optional<Estimates> estimates;
  std::vector<Device> devices;
  std::optional<YamlMap> simulation;  ///< the plant behind simulated devices; only drivers/simulated reads it
  std::string text;                   ///< the whole file, for the session
  std::filesystem::path file;
};

/// @throws ConfigError with file, line and key.
BenchConfig read_bench(const std::filesystem::path& path);

/// The same of a text, as the daemon hands out its bench. @param name what messages call it
BenchConfig parse_bench(std::string text, const std::filesystem::path& name);

}  // namespace emtb
