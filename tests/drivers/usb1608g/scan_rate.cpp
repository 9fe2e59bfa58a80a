// How fast a scan of a USB-1608G may come before the driver is the limit.
//
//     scan_rate [--seconds S]
//
// The emulated card hands over full transfers of counted samples as fast as the host asks for them: the real one gives
// 1 MB/s at most. Three figures, each over S seconds: the whole way, from libusb's transfers to the readings that the
// loop gets; libusb and the emulated kernel alone, without our own work on the bytes; and that work alone. Exit 1: a
// sample was lost or is another.

#include <array>
#include <chrono>
#include <iostream>
#include <string>
#include <vector>

#include "drivers/registry.h"
#include "drivers/usb1608g/input.h"
#include "drivers/usb1608g/transfers.h"
#include "tests/drivers/usb1608g/board.h"
#include "tests/drivers/usb1608g/counted_stream.h"

namespace emtb::usb1608g {
namespace {

constexpr std::array signals{Signal::u_ref, Signal::e_a, Signal::i_a, Signal::omega, Signal::torque};
constexpr std::uint64_t ahead = 200'000;  // [samples] below what waits for the loop at most
constexpr double sample = 2;              // [bytes]
constexpr double fastest = 100e3;         // [Hz] scans of five channels

double now() { return MonotonicClock().now(); }

void say(const std::string& what, double bytes, double seconds) {
  std::cout << what << ": " << bytes / seconds / 1e6 << " MB/s, " << bytes / sample / seconds / 1e6 << " MS/s\n";
}

/// Through libusb, the driver and the queue to the loop.
std::uint64_t whole_way(double seconds) {
  MockKernel kernel;
  Board board({});
  UsbPort port(kernel, 2, board);
  CountedStream stream(signals, ahead);
  board.stream([&](std::span<std::uint8_t> bytes) { return stream.give(bytes); });
  const Bench bench = open_bench(parse_bench(
      "name: b\nreference: {device: daq, min: 0, max: 6, safe: 0}\ndevices:\n  daq: {driver: usb1608g, calibration: "
      "nominal, latency: 0.02, rate: " +
          std::to_string(static_cast<int>(fastest)) + ", channels: {" + CountedStream::channels(signals) + "}}\n",
      "scan_rate.yaml"));
  InputDevice& input = *bench.inputs.at(0);
  std::vector<Reading> readings(65536);
  std::uint64_t faults = 0;
  input.start();
  const double began = now();
  while (now() < began + seconds) {
    const Readings got = input.read(readings);
    faults += got.fault == Fault::none ? 0 : 1;
    stream.take(std::span(readings).first(got.count));
    if (got.count == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));  // as a loop of 1 kHz does
  }
  say("whole way", sample * static_cast<double>(stream.taken()), now() - began);
  std::cout << "  " << stream.taken() << " samples, " << stream.wrong() << " lost or another, " << faults
            << " faults\n";
  return stream.wrong() + faults + (stream.taken() == 0 ? 1 : 0);
}

/// The same transfers, and their bytes thrown away.
void libusb_alone(double seconds) {
  MockKernel kernel;
  Board board({});
  UsbPort port(kernel, 2, board);
  board.stream([](std::span<std::uint8_t>) { return true; });
  Link link("", Access::requests_and_scan);
  link.send(Request::scan_list, 0, 0, scan_list(std::array{Slot{}}));
  const Packing packing = pack(fastest, signals.size(), 0.02, link.packet_size());
  double bytes = 0;
  Transfers transfers(link, 8, packing.transfer,
                      [&](std::span<const std::uint8_t> got) { bytes += static_cast<double>(got.size()); });
  link.send(Request::scan_start, 0, 0, scan_start({.period = 1000, .packet = packing.packet}));
  const double began = now();
  while (now() < began + seconds) link.pump(0.05);
  say("libusb and emulation alone, transfers of " + std::to_string(packing.transfer) + " bytes", bytes, now() - began);
}

/// Bytes from memory, made readings and taken.
void driver_alone(double seconds) {
  std::vector<Channel> channels;
  for (const Signal signal : signals) {
    channels.push_back({.signal = signal, .period = 1 / fastest, .source = {}, .conversion = {.scale = 1}});
  }
  CountedStream stream(signals, ahead);
  Handover handover(channels, 2 * ahead);
  const MonotonicClock clock;
  ClockReport report;
  const std::atomic<bool> quit = false;
  Scan scan(channels, 2, handover, clock, report, quit);
  std::vector<std::uint8_t> bytes(10'000);
  std::vector<Reading> readings(65536);
  const double began = now();
  while (now() < began + seconds) {
    stream.give(bytes);
    scan.take(bytes, [](std::size_t, std::uint32_t code) -> std::optional<double> {
      const auto word = static_cast<std::uint16_t>(code);
      if (saturated(word)) return std::nullopt;
      return volts_of(word, {}, 10);
    });
    stream.take(std::span(readings).first(handover.take(readings).count));
  }
  say("our work alone", sample * static_cast<double>(stream.taken()), now() - began);
}

}  // namespace
}  // namespace emtb::usb1608g

int main(int argc, char** argv) {
  double seconds = 5;
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() == 2 && words[0] == "--seconds") {
    seconds = std::stod(words[1]);
  } else if (!words.empty()) {
    std::cerr << "scan_rate [--seconds S]\n";
    return 2;
  }
  const std::uint64_t wrong = emtb::usb1608g::whole_way(seconds);
  emtb::usb1608g::libusb_alone(seconds);
  emtb::usb1608g::driver_alone(seconds);
  return wrong == 0 ? 0 : 1;
}
