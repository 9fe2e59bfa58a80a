#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

/// What the MCC USB-1608G, USB-1608GX and USB-1608GX-2AO want to hear and say: requests, layouts, numbers. No USB here.
///
/// A vendor request on endpoint 0 does everything but the scan itself, which comes through a bulk endpoint: samples of
/// 16 bits, lowest byte first, in the order of the scan list, paced by the card's own 64 MHz clock.
/// Sources: Linux_Drivers (W. Jasper) and uldaq (Measurement Computing). Where they disagree, the bench file decides.
namespace emtb::usb1608g {

inline constexpr std::uint16_t vendor_id = 0x09DB;
inline constexpr std::uint8_t scan_endpoint = 0x86;
inline constexpr double pacer_clock = 64e6;  ///< [Hz]
inline constexpr std::size_t slots = 16;     ///< of the scan list; always all are sent
inline constexpr int codes = 65536;          ///< of both converters: 32768 is 0 V

/// A kind of card that this driver knows.
struct Model {
  std::uint16_t product_id;
  std::string_view name;
  int revision;            ///< of the hardware; each has its own FPGA image
  double fastest;          ///< [Hz] samples, over all channels
  int outputs;             ///< analog
  std::size_t fpga_image;  ///< [bytes] of the vendor's image
};

std::span<const Model> models() noexcept;
/// @return the card of that product id, or nothing
const Model* model_of(std::uint16_t product_id) noexcept;

enum class Request : std::uint8_t {
  ain = 0x10,
  scan_start = 0x12,
  scan_stop = 0x13,
  scan_list = 0x14,
  scan_clear = 0x15,
  aout = 0x18,
  aout_scan_stop = 0x1B,
  memory = 0x30,
  memory_address = 0x31,
  status = 0x40,
  fpga_unlock = 0x50,
  fpga_data = 0x51,
};

/// The status word.
namespace status_bit {
inline constexpr std::uint16_t scan_running = 0x0002;
inline constexpr std::uint16_t scan_overrun = 0x0004;
inline constexpr std::uint16_t fpga_configured = 0x0100;
inline constexpr std::uint16_t fpga_configuring = 0x0200;
}  // namespace status_bit

inline constexpr std::uint8_t fpga_key = 0xAD;  ///< opens the door for an image
inline constexpr std::size_t fpga_piece = 64;   ///< [bytes] of an image at a time

// ---- Inputs

enum class Wiring : std::uint8_t { differential, single_ended };

/// One entry of the scan list.
struct Slot {
  int channel = 0;  ///< 0 to 7 differential, 0 to 15 single ended
  Wiring wiring = Wiring::single_ended;
  int range = 0;  ///< index into ranges
};

inline constexpr std::array<double, 4> ranges{10, 5, 2, 1};  ///< [V] full scale, of either sign

/// @return the index of the range whose full scale is `volts`, or nothing
std::optional<int> range_of(double volts) noexcept;
constexpr int channels_of(Wiring wiring) noexcept { return wiring == Wiring::differential ? 8 : 16; }

/// The scan list as it is sent. @param list 1 to 16 entries
std::array<std::uint8_t, slots> scan_list(std::span<const Slot> list) noexcept;

/// What the pacer counts: the vendor's library programs the time between scans; a comment in the other driver says
/// that between conversions. A known signal on two channels tells.
enum class Pacer : std::uint8_t { scan, conversion };

struct ScanStart {
  std::uint32_t period = 0;  ///< of the pacer, as the card wants it
  int packet = 1;            ///< samples a packet, 1 to 256
  int length = 15;           ///< [bytes] of this block: 15 with the trailing zero of the vendor's library, or 14
};

/// A scan that runs until it is stopped, on the card's own clock.
std::vector<std::uint8_t> scan_start(const ScanStart& start);

/// The pacer's period that comes nearest to so many scans a second.
std::uint32_t pacer_period(double rate, std::size_t channels, Pacer pacer) noexcept;
/// [Hz] scans that the card then really makes.
double scan_rate(std::uint32_t period, std::size_t channels, Pacer pacer) noexcept;

/// How a scan travels: `packet` samples make a USB packet, `transfer` bytes a transfer.
struct Packing {
  int packet = 1;
  std::size_t transfer = 512;
  bool whole_scans = true;  ///< each transfer is one packet of whole scans: then less is an error
};

/// Small packets where readings shall come soon, full ones where there are many.
/// @param latency [s] that samples may wait in the card @param max_packet [bytes] of the endpoint
Packing pack(double rate, std::size_t channels, double latency, std::size_t max_packet) noexcept;

/// The converter is at an end of its range: the voltage may be anything beyond.
constexpr bool saturated(std::uint16_t code) noexcept { return code <= 0x60 || code >= 0xFFFD; }

constexpr std::uint16_t little_endian(std::uint8_t low, std::uint8_t high) noexcept {
  return static_cast<std::uint16_t>(low | high << 8U);
}

}  // namespace emtb::usb1608g
