#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "tests/drivers/usb1608g/usb_port.h"

namespace emtb::usb1608g {

/// The card itself, from its own side of the cable: requests, memory, FPGA, scan on its own clock, outputs. Knows
/// nothing of the driver; numbers are from the maker's description, not from the driver's headers.
class Board final : public UsbDevice {
 public:
  struct Traits {
    std::uint16_t product = 0x0136;  ///< USB-1608GX-2AO, revision 2
    std::string serial = "01A2B3C4";
    bool configured = true;  ///< has its FPGA image
    float slope = 1;         ///< of every correction in its memory
    float offset = 0;
    std::size_t image = 73722;  ///< [bytes] that its FPGA takes
  };
  /// What lies at its 16 inputs at a time, while an output holds its voltage; times never go back.
  /// @param seconds of the card's life @param out0 [V] of output 0
  using World = std::function<std::array<double, 16>(double seconds, double out0)>;

  explicit Board(Traits traits, World world = {});

  // ---- What a person sees and does
  double output(int channel) const;                       ///< [V]
  std::vector<std::uint16_t> written(int channel) const;  ///< every code that was ever written
  bool scanning() const;
  std::uint32_t requests(std::uint8_t request) const;          ///< how many came
  std::vector<std::uint8_t> last(std::uint8_t request) const;  ///< data of the last one
  void set_input(int channel, double volts);                   ///< where there is no world
  /// From now on a scan gives what `give` writes, as fast as the host takes it, instead of what its clock and its
  /// inputs say. @param give fills a transfer; false: nothing yet
  void stream(std::function<bool(std::span<std::uint8_t>)> give);
  void overrun();                          ///< its buffer is full
  void halt_scan();                        ///< without a word
  void stall_scan();                       ///< the endpoint stalls until it is cleared
  void shorten_packet(std::size_t bytes);  ///< the next one
  void lose_fpga();
  void silence(bool silent);  ///< answers nothing any more
  void refuse(std::uint8_t request, bool refused = true);
  void overwrite_output(int channel, std::uint16_t code);  ///< as another program would
  void power_cycle(bool configured);

  // ---- What the host sees
  std::vector<std::uint8_t> descriptors() const override;
  int control(const Setup& setup, std::span<std::uint8_t> data) override;
  int bulk_in(std::uint8_t endpoint, std::span<std::uint8_t> data) override;
  void clear_halt(std::uint8_t endpoint) override;

 private:
  double now() const;
  void catch_up();
  std::uint16_t convert(std::uint8_t slot, const std::array<double, 16>& inputs) const;
  int standard(const Setup& setup, std::span<std::uint8_t> data) const;
  int vendor(const Setup& setup, std::span<std::uint8_t> data);
  std::optional<int> microcontroller(const Setup& setup, std::span<std::uint8_t> data);
  int fpga(const Setup& setup, std::span<std::uint8_t> data);
  std::uint16_t status() const;

  mutable std::mutex mutex_;
  Traits traits_;
  World world_;
  std::array<double, 16> still_{};
  std::chrono::steady_clock::time_point born_ = std::chrono::steady_clock::now();
  std::map<std::uint16_t, std::uint8_t> memory_;
  std::uint16_t address_ = 0;

  bool configured_;
  bool configuring_ = false;
  std::size_t image_ = 0;  // [bytes] so far
  std::array<std::uint8_t, 16> list_{};
  std::array<std::uint16_t, 2> dac_{0x8000, 0x8000};
  std::array<std::vector<std::uint16_t>, 2> written_;
  std::map<std::uint8_t, std::uint32_t> requests_;
  std::map<std::uint8_t, std::vector<std::uint8_t>> last_;
  std::map<std::uint8_t, bool> refused_;

  bool scanning_ = false, overrun_ = false, stalled_ = false, silent_ = false;
  double began_ = 0, period_ = 0;  // [s]
  std::uint64_t scans_ = 0;        // made
  std::size_t packet_ = 1;         // [samples]
  std::size_t shorten_ = 0;        // [bytes]
  std::deque<std::uint16_t> fifo_;
  std::function<bool(std::span<std::uint8_t>)> stream_;
};

}  // namespace emtb::usb1608g
