#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "drivers/driver.h"
#include "drivers/handover.h"
#include "drivers/serial_port.h"
#include "drivers/wake.h"
#include "hal/error.h"

namespace emtb::load_cell {

/// A load cell's amplifier that sends a line `12.34` [N] ten times a second. On a lever it measures torque.
///
/// A line that is no number is left out. A port that vanishes is Fault::device_lost until it is back.
class LoadCell final : public InputDevice {
 public:
  LoadCell(const std::string& name, std::shared_ptr<Clock> clock, std::string port, double lever)
      : clock_(std::move(clock)),
        port_(std::move(port)),
        lever_(lever),
        channel_{{{.signal = Signal::torque, .period = 0.1, .window = 0.1, .lsb = 0.01 * lever, .source = name}}},
        handover_(channel_),
        thread_([this, line = std::make_unique<SerialPort>(port_, settings)]() mutable { run(std::move(line)); }) {}
  ~LoadCell() override {
    quit_.wish();
    thread_.join();
  }

  std::span<const Channel> channels() const noexcept override { return channel_; }
  void start() override { handover_.restart(); }
  Readings read(std::span<Reading> out) noexcept override { return handover_.take(out); }

 private:
  static constexpr LineSettings settings{.baud = 9600};
  static constexpr double retry = 0.5;             // [s] between attempts to open a port that has gone
  static constexpr std::size_t longest_line = 16;  // [bytes] more is noise
  static constexpr const char* unknown = "?";      // the rest of a line whose beginning we missed is no number

  void run(std::unique_ptr<SerialPort> line) noexcept {
    while (!quit_.wished()) {
      try {
        if (!line) line = std::make_unique<SerialPort>(port_, settings);
        line->wait(1, quit_.descriptor());
        std::array<char, 64> buffer{};
        for (const char c : line->read(buffer)) take(c);
      } catch (const std::exception&) {  // pulled out, or not back yet
        line.reset();
        text_ = unknown;
        handover_.raise(Fault::device_lost);
        quit_.rest(retry);
      }
    }
  }
  void take(char c) {
    if (c != '\n') {
      if (text_.size() <= longest_line) text_ += c;
      return;
    }
    const std::string line = std::exchange(text_, {});
    if (line.size() > longest_line) return;
    const std::string_view number = std::string_view(line).substr(0, line.find('\r'));
    double force = 0;  // [N]
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), force);
    if (error != std::errc() || end != number.data() + number.size() || !std::isfinite(force)) return;
    handover_.deliver(Signal::torque, clock_->now(), lever_ * force);
    handover_.clear();
  }

  std::shared_ptr<Clock> clock_;
  std::string port_;
  double lever_;  ///< [m]
  std::array<Channel, 1> channel_;
  Handover handover_;
  std::string text_ = unknown;  ///< of the line so far
  Wake quit_;
  std::thread thread_;  ///< last: it uses all of the above
};

/// `load_cell`: port, lever [m].
inline OpenedDevice open(const OpenRequest& request) {
  request.need_real_time();
  const YamlMap& device = request.device.yaml;
  device.only({"driver", "port", "lever"});
  OpenedDevice opened;
  opened.input =
      std::make_unique<LoadCell>(request.device.name, request.clock, device.text("port"), device.positive("lever"));
  return opened;
}

}  // namespace emtb::load_cell
