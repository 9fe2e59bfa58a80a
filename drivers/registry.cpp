#include "drivers/registry.h"

#include <algorithm>
#include <array>
#include <optional>

#include "drivers/comedi/open.h"
#include "drivers/driver.h"
#include "drivers/modbus_meter/open.h"
#include "drivers/program/open.h"
#include "drivers/scpi_meter/open.h"
#include "drivers/serial_daq/open.h"
#include "drivers/serial_meter/open.h"
#include "drivers/simulated/open.h"
#include "drivers/simulated/plant_port.h"
#include "drivers/simulated/world.h"
#include "drivers/usb1608g/open.h"
#include "hal/error.h"

namespace emtb {
namespace {

/// Every driver there is: one line each, and a folder.
// clang-format off
constexpr std::array drivers{
    Driver{"comedi", comedi::open_card, comedi::check_card},
    Driver{"modbus_meter", modbus_meter::open_meter, check_input<modbus_meter::read_settings>},
    Driver{"program", program::open_program, program::check_program},
    Driver{"scpi_meter", scpi_meter::open_meter, check_input<scpi_meter::read_settings>},
    Driver{"serial_daq", serial_daq::open_board, serial_daq::check_board},
    Driver{"serial_meter", serial_meter::open_meter, check_input<serial_meter::read_settings>},
    Driver{"simulated_daq", simulated::open_daq, simulated::check_daq},
    Driver{"simulated_meter", simulated::open_meter, simulated::check_meter},
    Driver{"usb1608g", usb1608g::open_card, usb1608g::check_card},
};
// clang-format on

const Driver& driver_of(const BenchConfig::Device& device) {
  const auto found = std::ranges::find(drivers, device.driver, &Driver::name);
  if (found != drivers.end()) return *found;
  std::string known;
  for (const Driver& driver : drivers) known += (known.empty() ? "" : ", ") + std::string(driver.name);
  device.yaml.fail("driver", "is `" + device.driver + "`. Known: " + known);
}

/// A signal that two devices measure would be recorded as one.
void refuse_twins(const Bench& bench, const InputDevice& input, const BenchConfig::Device& device) {
  for (const auto& other : bench.inputs) {
    for (const Channel& theirs : other->channels()) {
      for (const Channel& ours : input.channels()) {
        if (ours.signal == theirs.signal) {
          device.yaml.fail("", "measures " + std::string(info(ours.signal).name) + ", but so does " + theirs.source +
                                   ". Remove it from one of them");
        }
      }
    }
  }
}

/// The bench's time, and the plant of a simulated one.
struct Setting {
  std::shared_ptr<Clock> clock;
  std::shared_ptr<simulated::World> world;
};

Setting setting_of(const BenchConfig& config) {
  if (config.simulation && simulated::plant_process_name(*config.simulation)) {
    simulated::read_plant(*config.simulation);  // for its complaints; the plant itself is in its own process
  } else if (config.simulation) {
    const std::shared_ptr<Clock> clock = simulated::open_clock(*config.simulation);
    return {.clock = clock, .world = simulated::open_world(*config.simulation, clock)};
  }
  return {.clock = std::make_shared<MonotonicClock>(), .world = {}};
}

Bench open(const BenchConfig& config, bool output_only) {
  Bench bench;
  const auto [clock, world] = setting_of(config);
  bench.clock = clock;
  for (const BenchConfig::Device& device : config.devices) {
    if (output_only && device.name != config.reference.device) continue;
    OpenedDevice opened = driver_of(device).open(
        {.bench = config, .device = device, .clock = bench.clock, .world = world, .output_only = output_only});
    if (opened.input) {
      refuse_twins(bench, *opened.input, device);
      bench.inputs.push_back(std::move(opened.input));
    }
    if (opened.output) bench.reference = std::move(opened.output);
  }
  if (!bench.reference) {
    config.reference.yaml.fail("device", "is `" + config.reference.device + "`, which has no analog output");
  }
  return bench;
}

}  // namespace

std::vector<std::string> complaints_of(const BenchConfig& config) {
  std::vector<std::string> complaints;
  const auto heard = [&](const auto& check) {
    try {
      check();
    } catch (const ConfigError& e) {
      complaints.emplace_back(e.what());
    }
  };
  Setting setting;
  heard([&] { setting = setting_of(config); });
  if (config.simulation && !complaints.empty()) return complaints;  // devices would complain of the lack of a plant
  for (const BenchConfig::Device& device : config.devices) {
    heard([&] {
      driver_of(device).check({.bench = config, .device = device, .clock = setting.clock, .world = setting.world});
    });
  }
  return complaints;
}

Bench open_bench(const BenchConfig& config) { return open(config, false); }

BenchInputs open_inputs(const BenchConfig& config) {
  BenchInputs inputs;
  const auto [clock, world] = setting_of(config);
  inputs.clock = clock;
  for (const BenchConfig::Device& device : config.devices) {
    BenchInputs::Device& opened = inputs.devices.emplace_back();
    opened.name = device.name;
    if (world && device.driver.starts_with("simulated_")) {  // a real one beside them sees a real machine
      opened.hold = [plant = world](Signal signal, double value) { plant->hold(signal, value); };
    }
    try {
      opened.input = driver_of(device)
                         .open({.bench = config, .device = device, .clock = clock, .world = world, .input_only = true})
                         .input;
    } catch (const DeviceError& e) {
      const std::string why = e.what();
      opened.why_not = why.starts_with(device.name + ":") ? why : device.name + ": " + why;
    }
  }
  return inputs;
}

Bench open_reference(const BenchConfig& config) { return open(config, true); }

}  // namespace emtb
