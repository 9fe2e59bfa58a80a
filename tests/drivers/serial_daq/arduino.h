#pragma once

#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <functional>
#include <string>

/// As much of an Arduino as the example sketch uses: pins, a clock, an interrupt, a serial line. One board a process,
/// for one thread.
namespace emtb::serial_daq::arduino {

struct Hardware {
  std::array<int, 20> digital{};
  std::array<int, 20> pwm{};
  std::array<int, 20> analog{};
  void (*edge)() = nullptr;
  std::string received;                              ///< not yet read
  std::function<void(const std::string&)> transmit;  ///< takes what the board sends
  std::uint32_t now = 0;                             ///< [us]
  int room = 63;                                     ///< [bytes] in the send buffer
};

inline Hardware hardware;

constexpr int LOW = 0, HIGH = 1, INPUT_PULLUP = 2, OUTPUT = 1, CHANGE = 1;
constexpr std::uint8_t A0 = 14, A1 = 15, A2 = 16;

inline std::uint32_t micros() { return hardware.now; }
inline void pinMode(int, int) {}
inline int digitalRead(std::uint8_t pin) { return hardware.digital[pin]; }
inline void digitalWrite(std::uint8_t pin, int level) { hardware.digital[pin] = level; }
inline int analogRead(std::uint8_t pin) { return hardware.analog[pin]; }
inline void analogWrite(std::uint8_t pin, int duty) { hardware.pwm[pin] = duty; }
inline int digitalPinToInterrupt(int pin) { return pin; }
inline void attachInterrupt(int, void (*routine)(), int) { hardware.edge = routine; }
inline void noInterrupts() {}
inline void interrupts() {}

struct {
  void begin(long) {}
  int available() const { return static_cast<int>(hardware.received.size()); }
  int read() const {
    const auto byte = static_cast<unsigned char>(hardware.received.front());
    hardware.received.erase(0, 1);
    return byte;
  }
  int availableForWrite() const { return hardware.room; }
  void write(const std::uint8_t* bytes, std::size_t count) const {
    hardware.transmit(std::string(reinterpret_cast<const char*>(bytes), count));
  }
} inline Serial;

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"  // an Arduino's idiom
#include "docs/serial-daq/emtb_board/emtb_board.ino"
#pragma GCC diagnostic pop

}  // namespace emtb::serial_daq::arduino
