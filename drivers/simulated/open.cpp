#include "drivers/simulated/open.h"

#include <cmath>

#include "drivers/settings.h"
#include "drivers/simulated/daq.h"
#include "drivers/simulated/meter.h"
#include "drivers/simulated/output.h"
#include "drivers/simulated/paced_clock.h"
#include "drivers/simulated/plant_port.h"
#include "drivers/simulated/remote.h"
#include "drivers/simulated/scanning_daq.h"
#include "hal/error.h"

namespace emtb::simulated {
namespace {

/// `pace: 10`, or `pace: max`.
double read_pace(const YamlMap& simulation) {
  if (simulation.text_or("pace", "1") == "max") return PacedClock::as_fast_as_possible;
  return simulation.within_or("pace", 0, unbounded, 1);
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
    value = yaml_.within_or(key, 0, unbounded, value);
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
  yaml.only({"gain",
             "offset",
             "rise",
             "fall",
             "min",
             "max",
             "knee",
             "dead_zone",
             "output_resistance",
             "current_limit",
             "lag",
             "delay",
             "sampling",
             "play",
             "one_quadrant",
             "coasts",
             "conduction_rise",
             "conduction_current",
             "chop_period",
             "chop_supply",
             "chop_decay",
             "rectified",
             "crest"});
  DriverParameters driver;
  Overlay(yaml)
      .any_sign("gain", driver.gain)
      .any_sign("offset", driver.offset)
      .positive("rise", driver.rise)
      .positive("fall", driver.fall)
      .any_sign("min", driver.min)
      .any_sign("max", driver.max)
      .not_negative("dead_zone", driver.dead_zone)
      .not_negative("knee", driver.knee)
      .not_negative("output_resistance", driver.output_resistance)
      .positive("current_limit", driver.current_limit)
      .not_negative("lag", driver.lag)
      .not_negative("sampling", driver.sampling)
      .not_negative("play", driver.play)
      .not_negative("conduction_rise", driver.conduction_rise)
      .positive("conduction_current", driver.conduction_current)
      .not_negative("chop_period", driver.chop_period)
      .positive("chop_supply", driver.chop_supply)
      .not_negative("chop_decay", driver.chop_decay)
      .not_negative("rectified", driver.rectified)
      .not_negative("crest", driver.crest);
  driver.delay = yaml.within_or("delay", 0, 10, 0);
  driver.one_quadrant = yaml.flag_or("one_quadrant", false);
  driver.coasts = yaml.flag_or("coasts", false);
  if (driver.min >= driver.max) yaml.fail(yaml.has("max") ? "max" : "min", "leaves no voltage. Write a max above min");
  return driver;
}

MotorParameters read_motor(const YamlMap& yaml) {
  yaml.only({"R_a",
             "L_a",
             "K_b",
             "K_m",
             "B",
             "J",
             "brush_drop",
             "brush_current",
             "heat_capacity",
             "heat_resistance",
             "reaction",
             "reaction_current",
             "field_drop",
             "field_time",
             "flux_hysteresis",
             "coercive_current",
             "windage",
             "windage_exponent",
             "windage_omega",
             "bearing_drag",
             "bearing_exponent"});
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
      .positive("heat_capacity", motor.heat_capacity)
      .positive("heat_resistance", motor.heat_resistance)
      .positive("reaction_current", motor.reaction_current)
      .positive("field_time", motor.field_time)
      .positive("coercive_current", motor.coercive_current)
      .not_negative("windage", motor.windage)
      .positive("windage_omega", motor.windage_omega)
      .not_negative("bearing_drag", motor.bearing_drag);
  motor.bearing_exponent = yaml.within_or("bearing_exponent", 0.01, 1, motor.bearing_exponent);
  motor.reaction = yaml.within_or("reaction", 0, 0.49, 0);
  motor.field_drop = yaml.within_or("field_drop", 0, 0.89, 0);
  motor.flux_hysteresis = yaml.within_or("flux_hysteresis", -0.49, 0.49, 0);
  motor.windage_exponent = yaml.within_or("windage_exponent", 1, 3, 2);
  return motor;
}

FrictionParameters read_friction(const YamlMap& yaml) {
  yaml.only({"law", "T_c", "T_s", "omega_s", "deflection", "T_d", "B_d", "gears", "warm_drop", "warm_time"});
  FrictionParameters friction;
  const std::string law = yaml.text_or("law", "bristle");
  if (law != "bristle" && law != "hard") yaml.fail("law", "is `" + law + "`. Known: bristle, hard");
  friction.law = law == "hard" ? FrictionLaw::hard : FrictionLaw::bristle;
  Overlay(yaml)
      .not_negative("T_c", friction.T_c)
      .not_negative("T_s", friction.T_s)
      .positive("omega_s", friction.omega_s)
      .positive("deflection", friction.deflection)
      .any_sign("B_d", friction.B_d)
      .positive("warm_time", friction.warm_time);
  friction.T_d = yaml.within_or("T_d", -friction.T_c, friction.T_c, 0);
  friction.gears = yaml.within_or("gears", 0, 0.99, 0);
  if (friction.gears > 0 && friction.T_c == 0) yaml.fail("gears", "needs dry friction. Write a T_c above 0");
  friction.warm_drop = yaml.within_or("warm_drop", 0, 0.99, 0);
  if (friction.B_d != 0 && friction.T_c == 0) yaml.fail("B_d", "needs dry friction. Write a T_c above 0");
  return friction;
}

ShaftParameters read_shaft(const YamlMap& yaml, double J) {
  yaml.only({"cogging", "cogging_second", "cogging_order", "cogging_phase", "stiffness", "damping", "J_2", "gap"});
  ShaftParameters shaft;
  Overlay(yaml)
      .any_sign("cogging", shaft.cogging)
      .any_sign("cogging_second", shaft.cogging_second)
      .positive("cogging_order", shaft.cogging_order)
      .any_sign("cogging_phase", shaft.cogging_phase)
      .positive("stiffness", shaft.stiffness)
      .not_negative("damping", shaft.damping)
      .not_negative("gap", shaft.gap);
  if (shaft.stiffness != unlimited) {
    shaft.J_2 = yaml.positive("J_2");
    if (shaft.J_2 >= J) yaml.fail("J_2", "is not below motor.J, of which it is a part");
  } else if (shaft.gap > 0) {
    yaml.fail("gap", "needs a compliant shaft. Add stiffness and J_2");
  }
  return shaft;
}

LoadParameters read_load(const YamlMap& yaml) {
  yaml.only({"torque", "brake", "eccentric", "eccentric_phase", "spring", "spring_torque", "eddy_torque", "eddy_omega",
             "eddy_heating"});
  LoadParameters load;
  Overlay(yaml)
      .any_sign("torque", load.torque)
      .not_negative("brake", load.brake)
      .not_negative("eddy_torque", load.eddy_torque)
      .positive("eddy_omega", load.eddy_omega)
      .any_sign("eccentric", load.eccentric)
      .any_sign("eccentric_phase", load.eccentric_phase)
      .not_negative("spring", load.spring)
      .any_sign("spring_torque", load.spring_torque)
      .not_negative("eddy_heating", load.eddy_heating);
  return load;
}

SensorParameters read_sensors(const YamlMap& yaml) {
  yaml.only({"tacho_lag", "ripple", "ripple_second", "ripple_order", "ripple_phase", "tacho_stick", "delay",
             "torque_lag", "supply"});
  SensorParameters sensors;
  Overlay(yaml)
      .not_negative("tacho_lag", sensors.tacho_lag)
      .any_sign("ripple", sensors.ripple)
      .any_sign("ripple_second", sensors.ripple_second)
      .positive("ripple_order", sensors.ripple_order)
      .any_sign("ripple_phase", sensors.ripple_phase)
      .not_negative("tacho_stick", sensors.tacho_stick)
      .not_negative("torque_lag", sensors.torque_lag)
      .not_negative("supply", sensors.supply);
  sensors.delay = yaml.within_or("delay", 0, 10, 0);
  return sensors;
}

Laws read_laws(const YamlMap& yaml) {
  const std::string laws = yaml.text_or("laws", "usual");
  if (laws != "usual" && laws != "other") yaml.fail("laws", "is `" + laws + "`. Known: usual, other");
  return laws == "other" ? Laws::other : Laws::usual;
}

int read_bits(const YamlMap& yaml, int fallback) { return whole_number(yaml, "bits", 0, 24, fallback); }

DaqChannel read_channel(Signal signal, int bits, const YamlMap& yaml) {
  yaml.only({"range", "bits", "noise", "correlation", "gain", "offset", "scale", "zero"});
  DaqChannel channel{.signal = signal, .bits = read_bits(yaml, bits)};
  const std::vector<double> range = yaml.numbers("range");
  if (range.size() != 2 || range[0] >= range[1]) {
    yaml.fail("range", "must be [lowest, highest] in " + std::string(info(signal).unit));
  }
  channel.low = range[0];
  channel.high = range[1];
  Overlay(yaml).not_negative("noise", channel.noise).any_sign("gain", channel.gain).any_sign("offset", channel.offset);
  channel.correlation = yaml.within_or("correlation", 0, 0.9999, 0);
  if (yaml.has("scale") || yaml.has("zero")) {
    channel.calibrated = {.scale = yaml.has("scale") ? read_scale(yaml) : channel.nominal().scale,
                          .zero = yaml.number_or("zero", channel.nominal().zero)};
  }
  return channel;
}

/// The plant's process, where the plant is not in this one.
std::optional<std::string> process_of(const OpenRequest& request) {
  if (request.world || !request.bench.simulation) return {};
  return plant_process_name(*request.bench.simulation);
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
  simulation.only({"pace", "process", "seed", "laws", "driver", "motor", "friction", "shaft", "load", "sensors"});
  PlantParameters plant;
  plant.laws = read_laws(simulation);
  if (const auto driver = simulation.map_if("driver")) plant.driver = read_driver(*driver);
  plant.motor = read_motor(simulation.map("motor"));
  if (const auto friction = simulation.map_if("friction")) plant.friction = read_friction(*friction);
  if (const auto shaft = simulation.map_if("shaft")) plant.shaft = read_shaft(*shaft, plant.motor.J);
  if (const auto load = simulation.map_if("load")) plant.load = read_load(*load);
  if (const auto sensors = simulation.map_if("sensors")) plant.sensors = read_sensors(*sensors);
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

std::vector<DaqChannel> read_channels(const YamlMap& device) {
  device.only({"driver", "bits", "channels", "clock"});
  const int bits = read_bits(device, 12);  // the paper's card
  const YamlMap entries = device.map("channels");
  std::vector<DaqChannel> channels;
  for (const auto& [name, entry] : entries.entries()) {
    const auto signal = signal_named(name);
    if (!signal || !measurable(*signal)) {
      entries.fail(name, "cannot be measured here. The simulated plant has u_ref, e_a, i_a, omega, theta, torque");
    }
    channels.push_back(read_channel(*signal, bits, entry));
  }
  if (channels.empty()) device.fail("channels", "is empty. Give at least one signal");
  return channels;
}

std::optional<CardClock> read_clock(const YamlMap& device) {
  const auto yaml = device.map_if("clock");
  if (!yaml) return {};
  yaml->only({"ppm", "block", "jitter"});
  CardClock clock;
  clock.ppm = yaml->within_or("ppm", -1000, 1000, clock.ppm);
  clock.block = yaml->within_or("block", 0, 0.1, clock.block);
  clock.jitter = yaml->within_or("jitter", 0, 0.1, clock.jitter);
  return clock;
}

MeterSettings read_meter(const YamlMap& device) {
  device.only({"driver", "signal", "period", "window", "resolution", "noise", "offset", "latency", "reads"});
  if (const std::string signal = device.text_or("signal", "i_a"); signal != "i_a") {
    device.fail("signal", "is `" + signal + "`, but the simulated meter sits in the armature circuit: i_a");
  }
  MeterSettings settings;
  Overlay(device)
      .positive("period", settings.period)
      .not_negative("resolution", settings.resolution)
      .not_negative("noise", settings.noise)
      .any_sign("offset", settings.offset)
      .not_negative("latency", settings.latency);
  settings.window = device.within_or("window", 1e-3, settings.period, settings.period);
  const std::string reads = device.text_or("reads", "mean");
  if (reads != "mean" && reads != "rms") device.fail("reads", "is `" + reads + "`. Known: mean, rms");
  settings.rms = reads == "rms";
  return settings;
}

namespace {

void check_reference(const OpenRequest& request) {
  if (request.drives_reference())
    request.bench.reference.yaml.only({"device", "min", "max", "safe", "safe_because", "rate"});
}

/// There is a plant, here or in a process of its own.
void check_plant(const OpenRequest& request) {
  if (!process_of(request)) need_world(request);
}

}  // namespace

void check_daq(const OpenRequest& request) {
  check_reference(request);
  read_clock(request.device.yaml);
  read_channels(request.device.yaml);
  check_plant(request);
}

void check_meter(const OpenRequest& request) {
  request.need_no_output();
  read_meter(request.device.yaml);
  check_plant(request);
}

OpenedDevice open_daq(const OpenRequest& request) {
  OpenedDevice opened;
  check_reference(request);
  if (const auto process = process_of(request)) {
    read_clock(request.device.yaml);  // complains of what the plant would complain of
    std::vector<Signal> signals;
    for (const DaqChannel& channel : read_channels(request.device.yaml)) signals.push_back(channel.signal);
    opened.input = std::make_unique<RemoteInput>(*process, request.device.name, signals, request.clock);
    if (request.drives_reference()) {
      opened.output = std::make_unique<RemoteOutput>(*process, request.bench.reference.limits, request.clock);
    }
    return opened;
  }
  const std::shared_ptr<World>& world = need_world(request);
  const double period = 1 / request.bench.rate;
  std::vector<DaqChannel> channels = read_channels(request.device.yaml);
  if (const auto clock = read_clock(request.device.yaml)) {
    opened.input = std::make_unique<ScanningDaq>(request.device.name, world, std::move(channels), period, *clock);
  } else {
    opened.input = std::make_unique<Daq>(request.device.name, world, std::move(channels), period);
  }
  if (request.drives_reference()) {
    opened.output = std::make_unique<Output>(world, request.bench.reference.limits);
  }
  return opened;
}

OpenedDevice open_meter(const OpenRequest& request) {
  OpenedDevice opened;
  if (const auto process = process_of(request)) {
    read_meter(request.device.yaml);  // complains of what the plant would complain of
    opened.input =
        std::make_unique<RemoteInput>(*process, request.device.name, std::vector{Signal::i_a}, request.clock);
    return opened;
  }
  const std::shared_ptr<World>& world = need_world(request);
  opened.input = std::make_unique<Meter>(request.device.name, world, read_meter(request.device.yaml));
  return opened;
}

}  // namespace emtb::simulated
