#include "drivers/simulated/plant_process.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "drivers/simulated/open.h"
#include "hal/deadline.h"
#include "hal/error.h"

namespace emtb::simulated {
namespace {

const YamlMap& simulation_of(const BenchConfig& bench) {
  if (!bench.simulation) {
    throw ConfigError(bench.file.string() + ": has no `simulation:`. A plant needs one");
  }
  if (!plant_process_name(*bench.simulation)) {
    bench.simulation->fail("process", "is missing. Write e.g. process: emtb-plant");
  }
  return *bench.simulation;
}

template <std::size_t size>
void copy(std::string_view text, std::array<char, size>& to) {
  to.fill('\0');
  std::copy_n(text.begin(), std::min(text.size(), size - 1), to.begin());
}

}  // namespace

PlantProcess::PlantProcess(const BenchConfig& bench)
    : clock_(std::make_shared<MonotonicClock>()),
      world_(open_world(simulation_of(bench), clock_)),
      memory_(PlantMemory::create(*plant_process_name(*bench.simulation), bench.reference.limits.safe)),
      period_(1 / bench.rate) {
  if (bench.devices.size() > PlantPort::most_devices) {
    throw ConfigError(bench.file.string() + ": a plant process has at most " + std::to_string(PlantPort::most_devices) +
                      " devices");
  }
  memory_->device_count = 0;
  for (const BenchConfig::Device& device : bench.devices) {
    const OpenRequest request{.bench = bench, .device = device, .clock = clock_, .world = world_};
    const bool daq = device.driver == "simulated_daq";
    if (!daq && device.driver != "simulated_meter") {
      device.yaml.fail("driver", "is `" + device.driver + "`. A plant process has simulated_daq and simulated_meter");
    }
    Instrument instrument{.device = (daq ? open_daq(request) : open_meter(request)).input};
    describe(device.name, instrument, memory_->devices[memory_->device_count++]);
    instruments_.push_back(std::move(instrument));
  }
  for (Instrument& instrument : instruments_) instrument.device->start();
  memory_->beat = clock_->now();
  memory_->ready = PlantPort::format;
}

void PlantProcess::describe(const std::string& name, Instrument& instrument, PlantPort::Device& port) const {
  instrument.port = &port;
  copy(name, port.name);
  const bool has_clock = instrument.device->own_clock().has_value();
  port.has_clock = has_clock ? 1 : 0;
  port.clock.store({});
  port.channel_count = 0;
  for (const Channel& channel : instrument.device->channels()) {
    PlantPort::ChannelText& text = port.channels[port.channel_count++];
    text = {.signal = index(channel.signal),
            .period = channel.period,
            .window = channel.window,
            .lsb = channel.lsb,
            .low = channel.low,
            .high = channel.high,
            .endless = channel.endless ? 1U : 0U,
            .source = {}};
    copy(channel.source, text.source);
    instrument.every_step = instrument.every_step || (channel.period <= period_ && !has_clock);
  }
}

void PlantProcess::step(std::uint64_t missed) noexcept {
  std::array<Reading, 64> readings;
  for (Instrument& instrument : instruments_) {
    if (instrument.every_step) instrument.left_out += missed;
    const Readings got = instrument.device->read(readings);
    for (std::size_t i = 0; i < got.count; ++i) {
      readings[i].sequence += instrument.left_out;
      instrument.port->publish(readings[i]);
    }
    if (const auto clock = instrument.device->own_clock()) instrument.port->clock.store(*clock);
  }
}

void PlantProcess::run(const std::atomic<bool>& quit, const Watch& watch) {
  double reference = memory_->reference.load();
  watch(clock_->now(), reference);
  Deadline deadline(clock_->now(), period_);
  while (!quit) {
    clock_->sleep_until(deadline.next());
    const double now = clock_->now();
    const double wanted = memory_->reference.load();
    world_->set_reference(wanted);
    step(deadline.woke(now));
    memory_->beat = now;
    if (wanted == reference) continue;
    reference = wanted;
    watch(now, wanted);
  }
  memory_->ended = 1;
}

}  // namespace emtb::simulated
