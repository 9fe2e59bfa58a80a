#include <gmock/gmock.h>

#include <cmath>

#include "drivers/connected.h"
#include "drivers/registry.h"
#include "drivers/usb1608g/open.h"
#include "hal/error.h"
#include "tests/drivers/device_log.h"
#include "tests/drivers/opened_bench.h"
#include "tests/drivers/usb1608g/board.h"
#include "tests/drivers/usb1608g/counted_stream.h"
#include "tests/temporary_file.h"

namespace emtb::usb1608g {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// A card in a socket of this machine, as far as libusb can tell.
class Usb1608gCard : public ::testing::Test {
 protected:
  void plug(const Board::Traits& traits = {}) {
    board = std::make_unique<Board>(traits);
    port = std::make_unique<UsbPort>(kernel, 2, *board);
  }
  /// The device of a bench file, in which `more` has been added to the card and to the reference.
  void open(const std::string& more = "", const std::string& reference = "") {
    bench = opened_bench("min: 0, max: 6, safe: 0.5" + reference, "driver: usb1608g" + more, channels);
  }
  std::string refusal(const std::string& more = "", const std::string& reference = "") {
    return refusal_of([&] { open(more, reference); });
  }
  InputDevice& input() { return *bench.inputs.at(0); }
  AnalogOutput& output() { return *bench.reference; }

  std::string channels =
      "omega: {channel: 0, wiring: single_ended, range: 10, scale: 20}, torque: {channel: 9, range: 5, scale: 0.2, "
      "offset: -0.1}, e_a: {channel: 2, wiring: differential, scale: 13}";
  MockKernel kernel;
  std::unique_ptr<Board> board;
  std::unique_ptr<UsbPort> port;
  Bench bench;
};

constexpr std::array input_signals{Signal::omega, Signal::torque, Signal::e_a, Signal::i_a};

TEST_F(Usb1608gCard, GivesReadingsInUnitsAtTheTimesOfItsOwnClock) {
  plug({.slope = 1.01F, .offset = -200});
  board->set_input(0, 5);
  board->set_input(9, 1);
  board->set_input(2, 3);
  board->set_input(10, 1);  // the other lead of differential channel 2
  open();
  EXPECT_FALSE(board->scanning()) << "nothing runs before start()";
  DeviceLog log(input());
  log.begin();
  ASSERT_TRUE(log.comes([&] { return log.readings.size() >= 300; }));
  EXPECT_THAT(log.faults, IsEmpty());
  EXPECT_NEAR(log.last(Signal::omega), 100, 0.01);
  EXPECT_NEAR(log.last(Signal::torque), 0.1, 1e-4);
  EXPECT_NEAR(log.last(Signal::e_a), 26, 0.01);
  EXPECT_LT(MonotonicClock().now() - log.expect_all_in_order(Signal::omega), 2);
  EXPECT_NEAR(input().channels()[0].lsb, 20 * 20.0 / 65536, 1e-9);
  EXPECT_DOUBLE_EQ(input().channels()[0].period, 0.005);
}

TEST_F(Usb1608gCard, IsToldTheScanAsTheBenchFileSays) {
  plug();
  open(", rate: 1000, latency: 0.004, pacer: conversion, start_bytes: 14");
  DeviceLog log(input());
  log.begin();
  ASSERT_TRUE(log.comes([&] { return !log.readings.empty(); }));
  EXPECT_THAT(board->last(0x14), ElementsAre(0x20, 0x49, 0x82, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0));
  // 64 MHz / 3000 - 1 = 21332 = 0x5354; four scans of three a packet
  EXPECT_THAT(board->last(0x12), ElementsAre(0, 0, 0, 0, 0, 0, 0, 0, 0x54, 0x53, 0, 0, 11, 0));
}

TEST_F(Usb1608gCard, LosesNothingOfAScanInFullPackets) {
  plug();
  channels =
      "omega: {channel: 0, scale: 1}, torque: {channel: 1, scale: 1}, e_a: {channel: 2}, i_a: {channel: 3, scale: 1}";
  open(", rate: 40000, latency: 0.02");  // 320 kB/s
  std::array<Reading, 4096> buffer{};
  input().start();
  std::array<std::uint64_t, signal_count> next{};
  std::size_t count = 0;
  ASSERT_TRUE(eventually([&] {
    for (Readings got = input().read(buffer); got.count > 0; got = input().read(buffer)) {
      EXPECT_EQ(got.fault, Fault::none);
      for (std::size_t k = 0; k < got.count; ++k) {
        EXPECT_EQ(buffer[k].sequence, next[index(buffer[k].signal)]++);
        ++count;
      }
    }
    return count > 100'000;
  }));
}

TEST_F(Usb1608gCard, LosesNothingOfAScanAsFastAsItCanBeEmulated) {
  plug();
  // So many samples may wait for a busy machine's turn.
  const auto stream = std::make_shared<CountedStream>(input_signals, 100'000);
  board->stream([stream](std::span<std::uint8_t> bytes) { return stream->give(bytes); });
  channels = CountedStream::channels(input_signals);
  open(", calibration: nominal, rate: 125000, latency: 0.02");  // 500 kS/s is what the real card can do
  std::vector<Reading> buffer(65536);
  input().start();
  ASSERT_TRUE(eventually([&] {
    for (Readings got = input().read(buffer); got.count > 0; got = input().read(buffer)) {
      EXPECT_EQ(got.fault, Fault::none);
      stream->take(std::span(buffer).first(got.count));
    }
    return stream->taken() > 2'000'000;
  }));
  EXPECT_EQ(stream->wrong(), 0U) << "each as it was sent, and none left out";
}

TEST_F(Usb1608gCard, ClampsItsOutputBelowEveryCaller) {
  plug();
  open();
  EXPECT_NEAR(board->output(0), 0.5, 2e-4) << "safe once it is open";
  const auto set = [&](double volts, std::uint16_t code) {
    EXPECT_EQ(output().set(volts), Fault::none);
    return eventually([&] { return board->written(0).back() == code; }, 10);
  };
  EXPECT_TRUE(set(6, 0xCCCD));
  EXPECT_TRUE(set(3, 42598));
  EXPECT_TRUE(set(60, 0xCCCD));
  EXPECT_TRUE(set(-5, 0x8000));
  EXPECT_TRUE(set(2, 39322));
  EXPECT_EQ(output().set(std::nan("")), Fault::non_finite);
  EXPECT_TRUE(eventually([&] { return board->written(0).back() == 34406; }, 10)) << "0.5 V, the safe value";
  for (const std::uint16_t code : board->written(0)) {
    EXPECT_GE(code, 0x8000);
    EXPECT_LE(code, 0xCCCD);
  }
  EXPECT_THAT(board->written(1), IsEmpty());
}

TEST_F(Usb1608gCard, WritesOnlyWhatChanges) {
  plug();
  open(", calibration: nominal", ", channel: 1, read_back: false");
  const std::size_t before = board->written(1).size();
  for (int k = 0; k < 1000; ++k) EXPECT_EQ(output().set(4), Fault::none);
  ASSERT_TRUE(eventually([&] { return board->output(1) > 3.9; }, 10));
  EXPECT_EQ(board->written(1).size(), before + 1);
  EXPECT_EQ(board->requests(0x31), 0U) << "its memory is left alone";
}

TEST_F(Usb1608gCard, IsMadeSafeWhenItIsClosedWhateverItHeld) {
  plug();
  open();
  EXPECT_EQ(output().set(6), Fault::none);
  ASSERT_TRUE(eventually([&] { return board->output(0) > 5.9; }, 10));
  bench = {};
  EXPECT_NEAR(board->output(0), 0.5, 1e-3);
  EXPECT_FALSE(board->scanning());
}

TEST_F(Usb1608gCard, AnOverrunIsAFaultAndAGapAndNeverSpliced) {
  plug();
  open();
  DeviceLog log(input());
  log.begin();
  ASSERT_TRUE(log.comes([&] { return log.readings.size() > 30; }));
  board->overrun();
  ASSERT_TRUE(log.comes_fault(Fault::samples_lost));
  board->set_input(0, 2);
  ASSERT_TRUE(log.comes([&] { return log.last(Signal::omega) > 39 && log.fault == Fault::none; }));
  const DeviceLog::Gap gap = log.longest_gap(Signal::omega);
  EXPECT_GT(gap.seconds, 0.05);
  EXPECT_NEAR(static_cast<double>(gap.numbers), gap.seconds / 0.005, 1) << "the gap is as long as the time";
}

TEST_F(Usb1608gCard, AScanThatStopsOrStallsOrComesInPiecesBeginsAnew) {
  plug();
  open();
  DeviceLog log(input());
  log.begin();
  const std::vector<std::function<void()>> mishaps{[&] { board->halt_scan(); }, [&] { board->stall_scan(); },
                                                   [&] { board->shorten_packet(5); },
                                                   [&] { board->shorten_packet(4); }};
  for (const auto& mishap : mishaps) {
    ASSERT_TRUE(log.comes([&] { return !log.readings.empty() && log.fault == Fault::none; }));
    log.readings.clear();
    mishap();
    ASSERT_TRUE(log.comes_fault(Fault::scan_broken));
  }
  EXPECT_TRUE(log.comes([&] { return !log.readings.empty() && log.fault == Fault::none; }));
}

TEST_F(Usb1608gCard, AnInputAtTheEndOfItsRangeIsAFaultAndNoReading) {
  plug();
  open();
  DeviceLog log(input());
  log.begin();
  ASSERT_TRUE(log.comes([&] { return !log.readings.empty(); }));
  board->set_input(9, 5.5);  // range 5
  ASSERT_TRUE(log.comes_fault(Fault::over_range));
  log.readings.clear();
  log.look_for(0.1);
  for (const Reading& reading : log.readings) EXPECT_NE(reading.signal, Signal::torque);
  board->set_input(9, 4.5);
  EXPECT_TRUE(log.comes([&] { return log.fault == Fault::none && log.last(Signal::torque) > 0.79; }));
}

TEST_F(Usb1608gCard, ThatIsUnpluggedIsLostAndReturnsWithItsOwnSerialNumber) {
  plug();
  open();
  DeviceLog log(input());
  log.begin();
  ASSERT_TRUE(log.comes([&] { return !log.readings.empty(); }));
  output().set(5);
  ASSERT_TRUE(eventually([&] { return board->output(0) > 4.9; }, 10));
  port->unplug();
  ASSERT_TRUE(log.comes_fault(Fault::device_lost));
  ASSERT_TRUE(eventually([&] { return output().make_safe() == Fault::output_failed; }, 10));
  Board other({.serial = "0BADBAD0"});
  UsbPort elsewhere(kernel, 3, other);
  log.look_for(1.2);
  EXPECT_EQ(log.fault, Fault::device_lost) << "another card is not this one";
  EXPECT_THAT(other.written(0), IsEmpty());
  board->power_cycle(true);
  port->plug();
  log.readings.clear();
  EXPECT_TRUE(log.comes([&] { return !log.readings.empty() && log.fault == Fault::none; }));
  EXPECT_TRUE(eventually([&] { return output().make_safe() == Fault::none; }, 10));
  EXPECT_NEAR(board->output(0), 0.5, 1e-3);
}

TEST_F(Usb1608gCard, AnOutputThatFailsOrReadsBackOtherwiseSaysSo) {
  plug();
  open();
  board->refuse(0x18);
  output().set(3);
  ASSERT_TRUE(eventually([&] { return output().set(3) == Fault::output_failed; }, 10));
  board->refuse(0x18, false);
  ASSERT_TRUE(eventually([&] { return output().set(3) == Fault::none && board->output(0) > 2.9; }, 10));
  const std::size_t before = board->written(0).size();
  board->overwrite_output(0, 0xFFFF);
  ASSERT_TRUE(eventually([&] { return output().set(3) == Fault::output_failed; }, 10));
  EXPECT_TRUE(eventually([&] { return board->written(0).size() > before && board->output(0) < 3.1; }, 10))
      << "and is told again";
}

TEST_F(Usb1608gCard, ThatAnswersNothingIsFoundOut) {
  plug();
  open();
  DeviceLog log(input());
  log.begin();
  ASSERT_TRUE(log.comes([&] { return !log.readings.empty(); }));
  board->silence(true);
  output().set(2);
  EXPECT_TRUE(eventually([&] { return output().set(2) == Fault::output_failed; }, 10));
  EXPECT_TRUE(log.comes_fault(Fault::device_lost));
  board->silence(false);
  EXPECT_TRUE(log.comes([&] { return log.fault == Fault::none && output().set(2) == Fault::none; }));
}

TEST_F(Usb1608gCard, WithoutAnImageIsGivenTheOneThatTheBenchFileNames) {
  plug({.configured = false});
  EXPECT_THAT(refusal(), HasSubstr("USB-1608GX-2AO 01A2B3C4: has no FPGA image since it was switched on. Write fpga: "
                                   "with the path of the vendor's image for hardware revision 2, 73722 bytes"));
  EXPECT_THAT(refusal(", fpga: /nonexistent.bin"), HasSubstr("FPGA image /nonexistent.bin: cannot be read"));
  const TemporaryFile wrong(".rev1", std::string(73829, 'x'));
  EXPECT_THAT(refusal(", fpga: " + wrong.path().string()),
              HasSubstr("has 73829 bytes, but hardware revision 2 takes one of 73722. Give the image of this card"));
  EXPECT_EQ(board->requests(0x51), 0U);
  const TemporaryFile image(".rev2", std::string(73722, 'x'));
  open(", fpga: " + image.path().string());
  EXPECT_EQ(board->requests(0x51), 1152U);
  DeviceLog log(input());
  log.begin();
  ASSERT_TRUE(log.comes([&] { return !log.readings.empty() && log.fault == Fault::none; }));
  board->lose_fpga();  // the host was asleep
  ASSERT_TRUE(log.comes_fault(Fault::device_lost));
  EXPECT_TRUE(log.comes([&] { return log.fault == Fault::none; }));
}

TEST_F(Usb1608gCard, ThatDoesNotTakeItsImageSaysSo) {
  plug({.configured = false, .image = 1});
  const TemporaryFile image(".rev2", std::string(73722, 'x'));
  EXPECT_THAT(refusal(", fpga: " + image.path().string()), HasSubstr("does not take the FPGA image"));
  board->refuse(0x50);
  EXPECT_THAT(refusal(", fpga: " + image.path().string()), HasSubstr("request 0x50: the card refuses it"));
}

TEST_F(Usb1608gCard, OfACalibrationThatCannotBeTrueIsNotTrusted) {
  plug({.slope = std::nanf("")});
  EXPECT_THAT(refusal(), HasSubstr("its memory holds no calibration of input range 0 that can be true. Have it "
                                   "calibrated, or write calibration: nominal"));
}

TEST_F(Usb1608gCard, IsChosenBySerialNumber) {
  EXPECT_THAT(refusal(), HasSubstr("daq: no USB-1608G, -1608GX or -1608GX-2AO is connected. Plug it in"));
  plug();
  Board other({.serial = "0BADBAD0"});
  UsbPort elsewhere(kernel, 3, other);
  const std::string several = refusal();
  EXPECT_THAT(several, HasSubstr("several cards are connected: USB-1608GX-2AO "));
  EXPECT_THAT(several, HasSubstr("Write serial: of the one that is meant"));
  EXPECT_THAT(refusal(", serial: 11111111"), HasSubstr("no card of serial 11111111 is connected; there is USB-1608GX"));
  open(", serial: 0BADBAD0");
  EXPECT_THAT(other.written(0), SizeIs(1));
  EXPECT_THAT(board->written(0), IsEmpty());
  EXPECT_THAT(connected_cards(), SizeIs(2));
}

TEST_F(Usb1608gCard, IsListedWithSerialPortsByTheirLastingNames) {
  plug();
  const std::filesystem::path dev =
      std::filesystem::path(::testing::TempDir()) / ("emtb_dev_" + std::to_string(getpid()));
  std::filesystem::create_directories(dev / "serial/by-id");
  for (const char* name : {"ttyUSB0", "ttyUSB1", "ttyACM0", "ttyS0"}) std::ofstream(dev / name) << "";
  std::filesystem::create_symlink("../../ttyUSB1", dev / "serial/by-id/usb-FTDI_A1B2-if00-port0");
  std::filesystem::create_symlink("../../ttyACM0", dev / "serial/by-id/usb-Arduino_Uno-if00");
  std::vector<std::string> lines;
  for (const auto& [what, entry] : connected_devices(dev)) lines.push_back(what + ": " + entry);
  std::filesystem::remove_all(dev);
  const std::string meter = "serial port: driver: serial_meter (or modbus_meter), port: " + dev.string();
  EXPECT_THAT(lines, ElementsAre("USB-1608GX-2AO: driver: usb1608g, serial: 01A2B3C4",
                                 "microcontroller board?: driver: serial_daq, port: " + dev.string() +
                                     "/serial/by-id/usb-Arduino_Uno-if00",
                                 meter + "/serial/by-id/usb-FTDI_A1B2-if00-port0", meter + "/ttyUSB0"));
}

TEST_F(Usb1608gCard, InUseByAnotherProgramIsMadeSafeAllTheSame) {
  plug();
  open();
  output().set(6);
  ASSERT_TRUE(eventually([&] { return board->output(0) > 5.9; }, 10));
  const TemporaryFile file(".yaml",
                           "name: b\nreference: {device: daq, min: 0, max: 6, safe: 0}\ndevices:\n  daq: {driver: "
                           "usb1608g, channels: {" +
                               channels + "}}\n  meter: {driver: serial_meter}\n");
  open_reference(read_bench(file.path()));
  EXPECT_THAT(board->written(0), Contains(0x8000));
  EXPECT_THAT(refusal(), HasSubstr("is in use by another program. Close that one"));
}

TEST_F(Usb1608gCard, WithoutAnOutputCannotDriveTheReference) {
  plug({.product = 0x0135});
  EXPECT_THAT(refusal(), HasSubstr("USB-1608GX 01A2B3C4: has no analog output 0. Only the -2AO has any"));
}

TEST_F(Usb1608gCard, EachMistakeInTheBenchFileHasItsLine) {
  const auto mistake = [&](const std::string& text) {
    const std::string all = refusal(text);
    return all.substr(all.find(".yaml:") + 1);
  };
  EXPECT_EQ(mistake(", pacer: fast"), "yaml:5: devices.daq.pacer is `fast`. Known: scan, conversion");
  EXPECT_EQ(mistake(", calibration: none"),
            "yaml:5: devices.daq.calibration is `none`. Known: card (what its memory holds), nominal");
  EXPECT_EQ(mistake(", rate: 200000"), "yaml:5: devices.daq.rate is 200000, but must be 1 to 166666");
  EXPECT_EQ(mistake(", start_bytes: 16"), "yaml:5: devices.daq.start_bytes is 16, but must be 14 to 15");
  channels = "omega: {channel: 16, scale: 1}";
  EXPECT_EQ(mistake(""), "yaml:5: devices.daq.channels.omega.channel is 16, but must be 0 to 15");
  channels = "omega: {channel: 8, wiring: differential, scale: 1}";
  EXPECT_EQ(mistake(""), "yaml:5: devices.daq.channels.omega.channel is 8, but must be 0 to 7");
  channels = "omega: {channel: 1}";
  EXPECT_EQ(mistake(""),
            "yaml:5: devices.daq.channels.omega.scale is missing: how many rad/s is one volt at the card?");
  channels = "e_a: {channel: 1, range: 3}";
  EXPECT_EQ(mistake(""),
            "yaml:5: devices.daq.channels.e_a.range is not one of the card's: 10, 5, 2 or 1 V, of either sign");
  channels = "theta: {channel: 1, scale: 1}";
  EXPECT_EQ(mistake(""),
            "yaml:5: devices.daq.channels.theta is no voltage. The card may give u_ref, e_a, i_a, omega, torque, i_f, "
            "temperature");
}

}  // namespace
}  // namespace emtb::usb1608g
