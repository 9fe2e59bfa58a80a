#include "drivers/serial_daq/open.h"

#include <cmath>
#include <numbers>

#include "drivers/settings.h"

namespace emtb::serial_daq {
namespace {

constexpr double lowest_rate = 20;        // [Hz] below, no limit would be checked in time
constexpr double highest_rate = 2000;     // [Hz]
constexpr std::size_t sample_frame = 24;  // [bytes]
constexpr double busiest = 0.9;           // of the line

class Input final : public InputDevice {
 public:
  explicit Input(std::shared_ptr<Board> board) : board_(std::move(board)) {}
  std::span<const Channel> channels() const noexcept override { return board_->channels(); }
  void start() override { board_->start(); }
  Readings read(std::span<Reading> out) noexcept override { return board_->read(out); }
  std::optional<ClockEstimate> own_clock() const noexcept override { return board_->clock(); }

 private:
  std::shared_ptr<Board> board_;
};

class Output final : public AnalogOutput {
 public:
  explicit Output(std::shared_ptr<Board> board) : board_(std::move(board)) {}
  Fault set(double volts) noexcept override { return board_->set(volts); }
  Fault make_safe() noexcept override { return board_->make_safe(); }
  Limits limits() const noexcept override { return board_->limits(); }

 private:
  std::shared_ptr<Board> board_;
};

std::optional<std::size_t> analog_named(const std::string& name) {
  for (std::size_t k = 0; k < analog_inputs; ++k) {
    if (name == "A" + std::to_string(k)) return k;
  }
  return std::nullopt;
}

Analog read_analog(const YamlMap& yaml, std::size_t input) {
  yaml.only({"from", "scale", "offset"});
  yaml.number("scale");  // must be there
  return {.input = input, .scale = read_scale(yaml), .offset = yaml.number_or("offset", 0)};
}

BoardChannel read_channel(Signal signal, const YamlMap& yaml, const YamlMap& device) {
  const std::string from = yaml.text("from");
  if (const auto input = analog_named(from)) return {.signal = signal, .source = read_analog(yaml, *input)};
  if (from == "encoder") {
    yaml.only({"from"});
    if (signal != Signal::omega && signal != Signal::theta)
      yaml.fail("from", "is encoder, which gives omega and theta");
    if (!device.has("counts")) device.fail("counts", "is missing: how many edges has a turn of the encoder?");
    const double counts = device.number("counts");
    if (counts == 0)
      device.fail("counts", "is 0. Write four times the encoder's lines; below 0 if it counts backwards");
    const double gear = device.has("gear") ? device.positive("gear") : 1;
    return {.signal = signal, .source = Encoder{.per_count = 2 * std::numbers::pi / counts / gear}};
  }
  if (from == "pwm") {
    yaml.only({"from"});
    if (signal != Signal::e_a) yaml.fail("from", "is pwm, which gives e_a");
    return {.signal = signal, .source = Pwm{}};
  }
  yaml.fail("from", "is `" + from + "`. Known: A0, A1, A2, encoder, pwm");
}

std::variant<double, Analog> read_bus(const YamlMap& device) {
  if (!device.has("bus"))
    device.fail("bus", "is missing: the supply of the H bridge, {volts: 12} or {from: A1, scale: 25}");
  const YamlMap bus = device.map("bus");
  if (bus.has("volts")) {
    bus.only({"volts"});
    return bus.positive("volts");
  }
  const auto input = analog_named(bus.text("from"));
  if (!input) bus.fail("from", "is `" + bus.text("from") + "`. Known: A0, A1, A2");
  return read_analog(bus, *input);
}

}  // namespace

BoardSettings read_settings(const YamlMap& device, const BenchConfig::Reference* reference) {
  device.only({"driver", "port", "line", "rate", "start_up", "counts", "gear", "bus", "channels"});
  BoardSettings settings{.port = device.text("port"), .channels = {}, .limits = {}};
  settings.line = read_line_key(device, settings.line, "115200 8N1");
  settings.rate = device.within_or("rate", lowest_rate, highest_rate, settings.rate);
  if (settings.rate * settings.line.wire_time(sample_frame) > busiest) {
    device.fail("rate", "is more than the line carries: at " + std::to_string(settings.line.baud) + " baud " +
                            std::to_string(static_cast<int>(busiest / settings.line.wire_time(sample_frame))) +
                            " Hz. Write less, or a faster line");
  }
  settings.start_up = device.within_or("start_up", 0.1, 60, settings.start_up);
  const YamlMap entries = device.map("channels");
  bool bus_matters = false;
  for (const auto& [name, entry] : entries.entries()) {
    settings.channels.push_back(read_channel(measured_signal(entries, name, name), entry, device));
    bus_matters = bus_matters || std::holds_alternative<Pwm>(settings.channels.back().source);
  }
  if (settings.channels.empty()) device.fail("channels", "is empty. Give at least one signal");
  if (bus_matters || device.has("bus")) settings.bus = read_bus(device);
  if (reference != nullptr) {
    reference->yaml.only({"device", "min", "max", "safe", "safe_because", "rate", "full_duty"});
    settings.limits = reference->limits;
    settings.full_duty = reference->yaml.positive("full_duty");
  }
  return settings;
}

namespace {

/// A board's PWM is told to be safe whatever it is opened for.
BoardSettings settings_of(const OpenRequest& request) {
  const bool has_reference = request.bench.reference.device == request.device.name;
  return read_settings(request.device.yaml, has_reference ? &request.bench.reference : nullptr);
}

}  // namespace

void check_board(const OpenRequest& request) {
  request.need_real_time();
  settings_of(request);
}

OpenedDevice open_board(const OpenRequest& request) {
  request.need_real_time();
  auto board = std::make_shared<Board>(request.device.name, request.clock, settings_of(request));
  OpenedDevice opened;
  if (request.drives_reference()) opened.output = std::make_unique<Output>(board);
  opened.input = std::make_unique<Input>(std::move(board));
  return opened;
}

}  // namespace emtb::serial_daq
