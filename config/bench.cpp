#include "config/bench.h"

#include <algorithm>
#include <array>
#include <sstream>

#include "config/format.h"
#include "config/shipped.h"
#include "hal/format_version.h"

namespace emtb {
namespace {

/// [Hz] Below, no limit would be checked in time; above, no loop of this kind keeps up.
constexpr double lowest_rate = 100;
constexpr double highest_rate = 10'000;

std::string volts(double value) {
  std::ostringstream text;
  text << value << " V";
  return text.str();
}

Realtime read_realtime(const YamlMap& yaml) {
  constexpr std::array<std::pair<std::string_view, Realtime>, 3> words{
      {{"require", Realtime::require}, {"prefer", Realtime::prefer}, {"off", Realtime::off}}};
  const std::string word = yaml.text_or("realtime", "prefer");
  for (const auto& [name, realtime] : words) {
    if (name == word) return realtime;
  }
  yaml.fail("realtime", "is `" + word + "`. Known: require, prefer, off");
}

std::vector<BenchConfig::Device> read_devices(const YamlMap& yaml) {
  std::vector<BenchConfig::Device> devices;
  for (auto& [name, entry] : yaml.map("devices").entries()) {
    std::string driver = entry.text("driver");
    devices.push_back({.name = name, .driver = std::move(driver), .yaml = std::move(entry)});
  }
  if (devices.empty()) yaml.fail("devices", "is empty. Give at least the one that drives the reference");
  return devices;
}

BenchConfig::Reference read_reference(const YamlMap& yaml, const std::vector<BenchConfig::Device>& devices) {
  YamlMap entry = yaml.map("reference");
  const std::string device = entry.text("device");
  if (std::ranges::find(devices, device, &BenchConfig::Device::name) == devices.end()) {
    std::string known;
    for (const auto& one : devices) known += (known.empty() ? "" : ", ") + one.name;
    entry.fail("device", "is `" + device + "`, which `devices` does not have. It has: " + known);
  }
  const Limits limits{.min = entry.number("min"), .max = entry.number("max"), .safe = entry.number("safe")};
  if (limits.min >= limits.max) {
    entry.fail("max", "is " + volts(limits.max) + ", but min is " + volts(limits.min) + ". Write a max above min");
  }
  if (limits.safe < limits.min || limits.safe > limits.max) {
    entry.fail("safe", "is " + volts(limits.safe) + ", but the reference goes from " + volts(limits.min) + " to " +
                           volts(limits.max) + ". Write a value within, usually 0");
  }
  const double rate = entry.within_or("rate", 0, unbounded, 0);
  std::string why = entry.text_or("safe_because", "");
  return {.device = device, .limits = limits, .rate = rate, .safe_because = std::move(why), .yaml = std::move(entry)};
}

BenchConfig::SafetyLimits read_limits(const YamlMap& yaml) {
  BenchConfig::SafetyLimits limits;
  const auto entry = yaml.map_if("limits");
  if (!entry) return limits;
  entry->only({"omega", "i_a", "torque", "time"});
  const auto read = [&](std::string_view key) {
    return entry->has(key) ? std::optional{entry->positive(key)} : std::nullopt;
  };
  limits.omega = read("omega");
  limits.i_a = read("i_a");
  limits.torque = read("torque");
  limits.time = read("time");
  return limits;
}

std::optional<double> read_field(const YamlMap& yaml) {
  const auto entry = yaml.map_if("field");
  if (!entry) return {};
  entry->only({"min"});
  return entry->positive("min");
}

BenchConfig::Nameplate read_motor(const YamlMap& yaml) {
  const auto entry = yaml.map_if("motor");
  if (!entry) return {};
  entry->only({"R_a", "K_b", "driver_gain"});
  const auto read = [&](std::string_view key) {
    return entry->has(key) ? std::optional{entry->positive(key)} : std::nullopt;
  };
  return {.R_a = read("R_a"), .K_b = read("K_b"), .driver_gain = read("driver_gain")};
}

std::optional<BenchConfig::Tacho> read_tacho(const YamlMap& yaml, const BenchConfig::Nameplate& motor) {
  const auto entry = yaml.map_if("tacho");
  if (!entry) return {};
  entry->only({"emf", "omega", "time"});
  if (!motor.R_a)
    entry->fail("", "needs the armature's resistance. Write motor: {R_a: ...} with what an ohmmeter says");
  const BenchConfig::Tacho tacho{
      .emf = entry->positive("emf"), .omega = entry->positive("omega"), .time = entry->within_or("time", 0.1, 10, 1)};
  if (motor.K_b && *motor.K_b * tacho.omega > tacho.emf / 2) {
    std::ostringstream most;
    most << tacho.emf / 2 / *motor.K_b;
    entry->fail("omega",
                "is so high that a healthy motor could give emf below it. Write " + most.str() + " rad/s or less");
  }
  return tacho;
}

BenchConfig::Spin read_spin(const YamlMap& yaml, const Limits& limits) {
  BenchConfig::Spin spin;
  spin.u_ref = limits.max / 6;
  const auto entry = yaml.map_if("spin");
  if (!entry) return spin;
  entry->only({"u_ref", "hold", "tolerance"});
  spin.u_ref = entry->within_or("u_ref", 0, limits.max, spin.u_ref);
  spin.hold = entry->within_or("hold", 1, 60, spin.hold);
  spin.tolerance = entry->within_or("tolerance", 0.01, 1, spin.tolerance);
  return spin;
}

std::optional<BenchConfig::Estimates> read_estimates(const YamlMap& yaml, const std::filesystem::path& bench) {
  const auto entry = yaml.map_if("estimates");
  if (!entry) return {};
  entry->only({"model", "rate"});
  return BenchConfig::Estimates{.model = beside_or_shipped(bench.parent_path(), entry->text("model"), "models"),
                                .rate = entry->within_or("rate", 0.1, 50, 10)};
}

}  // namespace

BenchConfig read_bench(const std::filesystem::path& path) { return parse_bench(YamlMap::read_text(path), path); }

BenchConfig parse_bench(std::string text, const std::filesystem::path& path) {
  const YamlMap yaml = YamlMap::parse(text, path.string());
  read_format(yaml, "bench", newest_format::bench);
  yaml.only({"format", "name", "rate", "realtime", "reference", "limits", "field", "motor", "tacho", "spin",
             "estimates", "devices", "simulation"});
  std::vector<BenchConfig::Device> devices = read_devices(yaml);
  BenchConfig::Reference reference = read_reference(yaml, devices);
  const BenchConfig::Nameplate motor = read_motor(yaml);
  const BenchConfig::Spin spin = read_spin(yaml, reference.limits);
  return {.name = yaml.text("name"),
          .rate = yaml.within_or("rate", lowest_rate, highest_rate, 1000),
          .realtime = read_realtime(yaml),
          .reference = std::move(reference),
          .limits = read_limits(yaml),
          .field_min = read_field(yaml),
          .motor = motor,
          .tacho = read_tacho(yaml, motor),
          .spin = spin,
          .estimates = read_estimates(yaml, path),
          .devices = std::move(devices),
          .simulation = yaml.map_if("simulation"),
          .text = std::move(text),
          .file = path};
}

}  // namespace emtb
