#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <functional>
#include <memory>
#include <mutex>
#include <numbers>
#include <optional>
#include <string>
#include <thread>

#include "drivers/simulated/plant.h"
#include "hal/clock.h"
#include "tests/drivers/pseudo_terminal.h"
#include "tests/drivers/serial_daq/arduino.h"

namespace emtb::serial_daq {

/// A student's desk: the sketch as shipped on a board, an H bridge at 12 V, a small motor with an encoder of 2000
/// counts, and a line whose frames a test may spoil.
class Desk {
 public:
  static constexpr double bus = 12;       // [V]
  static constexpr double counts = 2000;  // a turn

  Desk() {
    arduino::hardware = {};
    arduino::hardware.transmit = [this](const std::string& frame) {
      const std::lock_guard lock(mutex_);
      const std::string sent = spoil_ ? spoil_(frame) : frame;
      if (line_) line_->write(sent);
    };
    plug();
    arduino::setup();
    life_.emplace([this] { turn(); });
  }
  ~Desk() { life_.reset(); }

  std::string port() const { return name_.path(); }
  void plug() {
    const std::lock_guard lock(mutex_);
    line_ = std::make_unique<PseudoTerminal>();
    name_.stand_for(line_->path());
  }
  void unplug() {
    const std::lock_guard lock(mutex_);
    line_.reset();
  }
  /// What becomes of each frame that the board sends.
  void spoil(std::function<std::string(const std::string&)> spoil) {
    const std::lock_guard lock(mutex_);
    spoil_ = std::move(spoil);
  }
  void make_deaf(bool deaf) { deaf_ = deaf; }  ///< nothing reaches the board
  void reset() { reset_ = true; }              ///< its button

  double duty() const { return duty_; }      ///< at the pins, -1 to 1
  bool dropped() const { return dropped_; }  ///< its watchdog has bitten
  double omega() const { return omega_; }
  double current() const { return current_; }

 private:
  static simulated::PlantParameters motor() {
    simulated::PlantParameters p;
    p.driver.gain = 1;
    p.driver.min = -bus;
    p.driver.max = bus;
    p.motor.R_a = 2;
    p.motor.K_b = p.motor.K_m = 0.05;
    p.motor.B = 2e-5;
    p.motor.J = 2e-5;
    return p;
  }
  void turn() {
    auto& hardware = arduino::hardware;
    if (reset_.exchange(false)) arduino::setup();
    const double now = clock_.now();
    const double at_pins = (hardware.digital[8] != 0 ? -1 : 1) * hardware.pwm[9] / 255.0;
    plant_.advance(std::max(now - last_, 1e-6), at_pins * bus);
    last_ = now;
    hardware.now = static_cast<std::uint32_t>(static_cast<std::uint64_t>(now * 1e6));
    count_to(std::floor(plant_.theta() / (2 * std::numbers::pi) * counts));
    hardware.analog[arduino::A0] = static_cast<int>(std::lround(std::clamp(511.5 + plant_.i_a() * 51.15, 0.0, 1023.0)));
    hardware.analog[arduino::A1] = static_cast<int>(std::lround(bus / 25 * 1023));
    {
      const std::lock_guard lock(mutex_);
      if (line_) hardware.received += line_->read(0);
    }
    if (deaf_) hardware.received.clear();
    arduino::loop();
    duty_ = at_pins;
    dropped_ = arduino::dropped;
    omega_ = plant_.omega();
    current_ = plant_.i_a();
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  /// The encoder's edges, one by one, with A ahead of B when it turns forward.
  void count_to(double target) {
    for (; count_ != target; count_ += count_ < target ? 1 : -1) {
      const int phase = static_cast<int>(std::fmod(std::fmod(count_ + (count_ < target ? 1 : -1), 4) + 4, 4));
      arduino::hardware.digital[2] = phase == 1 || phase == 2;
      arduino::hardware.digital[3] = phase == 2 || phase == 3;
      if (arduino::hardware.edge != nullptr) arduino::hardware.edge();
    }
  }

  std::mutex mutex_;
  PortName name_;
  std::unique_ptr<PseudoTerminal> line_;
  std::function<std::string(const std::string&)> spoil_;
  simulated::Plant plant_{motor()};
  MonotonicClock clock_;
  double last_ = clock_.now();
  double count_ = 0;
  std::atomic<bool> deaf_ = false, reset_ = false, dropped_ = false;
  std::atomic<double> duty_ = 0, omega_ = 0, current_ = 0;
  std::optional<AtTheOtherEnd> life_;
};

}  // namespace emtb::serial_daq
