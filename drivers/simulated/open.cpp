#include "drivers/simulated/open.h"

#include <cmath>
#include <limits>

#include "drivers/simulated/daq.h"
#include "drivers/simulated/meter.h"
#include "drivers/simulated/output.h"
#include "drivers/simulated/paced_clock.h"
#include "hal/error.h"

namespace emtb::simulated {
namespace {

constexpr double any = std::numeric_limits<double>::infinity();

/// `pace: 10`, or `pace: max`.
double read_pace(const YamlMap& simulation) {
  if (simulation.text_or("pace", "1") == "max") return PacedClock::as_fast_as_possible;
  return simulation.within_or("pace", 0, any, 1);
}

/// Those keys of a map that are there replace the ideal values; none may be below zero.
class Overlay {
 public:
  explicit Overlay(const YamlMap& yaml) : yaml_(yaml) {}
  Overlay& positive(std::string_view key, double& value) {
    if (yaml_.has(key)) value = yaml_.positive(key);
    return *this;
  }
  Overlay& not_negative(std::string_view key, double& value) {
    value = yaml_.within_or(key, 0, any, value);
    return *this;
  }
  Overlay& any_sign(std::string_view key, double& value) {
    value = yaml_.number_or(key, value);
    return *this;
  }

 private:
  const YamlMap& yaml_;
};

DriverParameters read_driver(const YamlMap& yaml) {
  yaml.only({"gain", "rise", "fall", "min", "max", "dead_zone", "output_resistance"});
  DriverParameters driver;
  Overlay(yaml)
      .any_sign("gain", driver.gain)
      .positive("rise", driver.rise)
      .positive("fall", driver.fall)
      .any_sign("min", driver.min)
      .any_sign("max", driver.max)
      .not_negative("dead_zone", driver.dead_zone)
      .not_negative("output_resistance", driver.output_resistance);
  if (driver.min >= driver.max) yaml.fail(yaml.has("max") ? "max" : "min", "leaves no voltage. Write a max above min");
  return driver;
}

MotorParameters read_motor(const YamlMap& yaml) {
  yaml.only({"R_a", "L_a", "K_b", "K_m", "B", "J", "brush_drop", "brush_current", "windage"});
  MotorParameters motor;
  motor.R_a = yaml.positive("R_a");
  motor.K_b = yaml.positive("K_b");
  motor.K_m = yaml.positive("K_m");
  motor.J = yaml.positive("J");
  Overlay(yaml)
      .not_negative("L_a", motor.L_a)
      .not_negative("B", motor.B)
      .not_negative("brush_drop", motor.brush_drop)
      .positive("brush_current", motor.brush_current)
      .not_negative("windage", motor.windage);
  return motor;
}

FrictionParameters read_friction(const YamlMap& yaml) {
  yaml.only({"law", "T_c", "T_s", "omega_s", "deflection"});
  FrictionParameters friction;
  const std::string law = yaml.text_or("law", "bristle");
  if (law != "bristle" && law != "hard") yaml.fail("law", "is `" + law + "`. Known: bristle, hard");
  friction.law = law == "hard" ? FrictionLaw::hard : FrictionLaw::bristle;
  Overlay(yaml)
      .not_negative("T_c", friction.T_c)
      .not_negative("T_s", friction.T_s)
      .positive("omega_s", friction.omega_s)
      .positive("deflection", friction.deflection);
  return friction;
}

LoadParameters read_load(const YamlMap& yaml) {
  yaml.only({"torque", "eddy_torque", "eddy_omega"});
  LoadParameters load;
  Overlay(yaml)
      .any_sign("torque", load.torque)
      .not_negative("eddy_torque", load.eddy_torque)
      .positive("eddy_omega", load.eddy_omega);
  return load;
}

int read_bits(const YamlMap& yaml, int fallback) {
  const double bits = yaml.within_or("bits", 0, 24, fallback);
  if (bits != std::floor(bits)) yaml.fail("bits", "must be a whole number");
  return static_cast<int>(bits);
}

DaqChannel read_channel(Signal signal, int bits, const YamlMap& yaml) {
  yaml.only({"range", "bits", "noise", "correlation", "gain", "offset"});
  DaqChannel channel{.signal = signal, .bits = read_bits(yaml, bits)};
  const std::vector<double> range = yaml.numbers("range");
  if (range.size() != 2 || range[0] >= range[1]) {
    yaml.fail("range", "must be [lowest, highest] in " + std::string(info(signal).unit));
  }
  channel.low = range[0];
  channel.high = range[1];
  Overlay(yaml).not_negative("noise", channel.noise).any_sign("gain", channel.gain).any_sign("offset", channel.offset);
  channel.correlation = yaml.within_or("correlation", 0, 0.9999, 0);
  return channel;
}

const std::shared_ptr<World>& need_world(const OpenRequest& request) {
  if (!request.world) {
    request.device.yaml.fail(
        "driver",
        "is " + request.device.driver + ", which needs the plant. Write a `simulation:` block at the end of the file");
  }
  return request.world;
}

}  // namespace

PlantParameters read_plant(const YamlMap& simulation) {
  simulation.only({"pace", "seed", "driver", "motor", "friction", "load", "tacho_lag"});
  PlantParameters plant;
  if (const auto driver = simulation.map_if("driver")) plant.driver = read_driver(*driver);
  plant.motor = read_motor(simulation.map("motor"));
  if (const auto friction = simulation.map_if("friction")) plant.friction = read_friction(*friction);
  if (const auto load = simulation.map_if("load")) plant.load = read_load(*load);
  plant.tacho_lag = simulation.within_or("tacho_lag", 0, any, 0);
  return plant;
}

std::shared_ptr<Clock> open_clock(const YamlMap& simulation) {
  const double pace = read_pace(simulation);
  if (pace == 1) return std::make_shared<MonotonicClock>();
  return std::make_shared<PacedClock>(pace);
}

std::shared_ptr<World> open_world(const YamlMap& simulation, std::shared_ptr<Clock> clock) {
  const double seed = simulation.within_or("seed", 0, 0x1p53, 0);
  return std::make_shared<World>(read_plant(simulation), std::move(clock), static_cast<std::uint64_t>(seed));
}

OpenedDevice open_daq(const OpenRequest& request) {
  const YamlMap& yaml = request.device.yaml;
  yaml.only({"driver", "bits", "channels"});
  const std::shared_ptr<World>& world = need_world(request);
  const int bits = read_bits(yaml, 12);  // the paper's card
  const YamlMap entries = yaml.map("channels");
  std::vector<DaqChannel> channels;
  for (const auto& [name, entry] : entries.entries()) {
    const auto signal = signal_named(name);
    if (!signal || !measurable(*signal)) {
      entries.fail(name, "cannot be measured here. The simulated plant has u_ref, e_a, i_a, omega, theta, torque");
    }
    channels.push_back(read_channel(*signal, bits, entry));
  }
  if (channels.empty()) yaml.fail("channels", "is empty. Give at least one signal");
  OpenedDevice opened;
  opened.input = std::make_unique<Daq>(request.device.name, world, std::move(channels), 1 / request.bench.rate);
  if (request.drives_reference()) {
    request.bench.reference.yaml.only({"device", "min", "max", "safe", "rate"});
    opened.output = std::make_unique<Output>(world, request.bench.reference.limits);
  }
  return opened;
}

OpenedDevice open_meter(const OpenRequest& request) {
  const YamlMap& yaml = request.device.yaml;
  yaml.only({"driver", "signal", "period", "window", "resolution", "noise", "latency"});
  const std::shared_ptr<World>& world = need_world(request);
  if (const std::string signal = yaml.text_or("signal", "i_a"); signal != "i_a") {
    yaml.fail("signal", "is `" + signal + "`, but the simulated meter sits in the armature circuit: i_a");
  }
  MeterSettings settings;
  Overlay(yaml)
      .positive("period", settings.period)
      .not_negative("resolution", settings.resolution)
      .not_negative("noise", settings.noise)
      .not_negative("latency", settings.latency);
  settings.window = yaml.within_or("window", 1e-3, settings.period, settings.period);
  OpenedDevice opened;
  opened.input = std::make_unique<Meter>(request.device.name, world, settings);
  return opened;
}

}  // namespace emtb::simulated
