#include "drivers/modbus_meter/open.h"

#include <charconv>
#include <cmath>

#include "drivers/settings.h"

namespace emtb::modbus_meter {
namespace {

constexpr int usual_tcp_port = 502;

Address read_address(const YamlMap& device) {
  if (device.has("tcp") == device.has("port")) {
    device.fail("tcp", "or port: give one of them, tcp: HOST:PORT or port: /dev/...");
  }
  if (device.has("port")) {
    return RtuAddress{.port = device.text("port"), .line = read_line_key(device, {}, "9600 8N1")};
  }
  if (device.has("line")) device.fail("line", "is for a serial line, but the meter is on tcp. Remove it");
  const std::string text = device.text("tcp");
  const std::size_t colon = text.rfind(':');
  TcpAddress address{.host = text.substr(0, colon), .port = usual_tcp_port};
  if (colon != std::string::npos) {
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data() + colon + 1, end, address.port);
    if (error != std::errc() || stop != end || address.port < 1 || address.port > 65535) {
      device.fail("tcp", "is `" + text + "`. Write HOST or HOST:PORT, 192.168.1.20:502");
    }
  }
  return address;
}

Register read_register(Signal signal, const YamlMap& yaml) {
  yaml.only(
      {"address", "function", "type", "order", "scale", "offset", "unit", "overload", "window", "resolution", "range"});
  Register entry;
  entry.signal = signal;
  if (!yaml.has("address")) yaml.fail("address", "is missing");
  entry.address = whole_number(yaml, "address", 0, 65535, 0);
  entry.function = whole_number(yaml, "function", 3, 4, 4);
  const auto type = type_named(yaml.text("type"));
  if (!type) yaml.fail("type", "is `" + yaml.text("type") + "`. Known: u16, s16, u32, s32, f32");
  entry.type = *type;
  const auto order = order_named(yaml.text_or("order", "ABCD"));
  if (!order) yaml.fail("order", "is `" + yaml.text("order") + "`. Known: ABCD, CDAB, BADC, DCBA");
  entry.order = *order;

  entry.scaling = read_scaling(signal, yaml);
  if (yaml.has("overload")) entry.overload = yaml.number("overload");
  entry.window = yaml.within_or("window", 0, unbounded, 0);
  if (entry.scaling.digit == 0 && entry.type != Type::f32) entry.scaling.digit = std::abs(entry.scaling.scale);
  return entry;
}

}  // namespace

MeterSettings read_settings(const YamlMap& device) {
  device.only({"driver", "tcp", "port", "line", "unit", "period", "timeout", "latency", "registers"});
  MeterSettings settings{
      .address = read_address(device), .unit = whole_number(device, "unit", 0, 255, 1), .registers = {}};
  settings.period = device.has("period") ? device.positive("period") : settings.period;
  settings.timeout = device.within_or("timeout", 0.01, 60, settings.timeout);
  settings.latency = device.within_or("latency", 0, unbounded, 0);
  const YamlMap registers = device.map("registers");
  for (const auto& [name, entry] : registers.entries()) {
    settings.registers.push_back(read_register(measured_signal(registers, name, name), entry));
  }
  if (settings.registers.empty()) device.fail("registers", "is empty. Give at least one signal");
  return settings;
}

OpenedDevice open_meter(const OpenRequest& request) { return open_input<Meter>(request, read_settings); }

}  // namespace emtb::modbus_meter
