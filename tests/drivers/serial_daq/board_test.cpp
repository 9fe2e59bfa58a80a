#include "drivers/serial_daq/board.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "drivers/registry.h"
#include "drivers/serial_daq/open.h"
#include "hal/error.h"
#include "tests/drivers/device_log.h"
#include "tests/drivers/opened_bench.h"
#include "tests/drivers/serial_daq/desk.h"
#include "tests/temporary_file.h"

namespace emtb::serial_daq {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// ---- Frames and messages

std::vector<std::uint8_t> bytes_of(std::string_view text) { return {text.begin(), text.end()}; }

std::vector<std::vector<std::uint8_t>> heard(FrameReader& reader, std::string_view bytes) {
  std::vector<std::vector<std::uint8_t>> messages;
  reader.feed(bytes,
              [&](std::span<const std::uint8_t> message) { messages.emplace_back(message.begin(), message.end()); });
  return messages;
}

TEST(SerialDaqFrame, IsWhatThePageSays) {
  EXPECT_EQ(crc(bytes_of("123456789")), 0x29B1) << "the CRC's usual check";
  EXPECT_EQ(arduino::crc(bytes_of("123456789").data(), 9), 0x29B1) << "and the sketch's";
  const std::string frame = framed(bytes_of("h"));
  ASSERT_EQ(frame.size(), 5U);
  EXPECT_EQ(frame[0], 4);
  EXPECT_EQ(frame[1], 'h');
  EXPECT_EQ(frame[4], 0);
  EXPECT_EQ(std::count(frame.begin(), frame.end(), '\0'), 1);
}

TEST(SerialDaqFrame, CarriesEveryMessage) {
  std::mt19937 random(3);
  FrameReader reader;
  for (int n = 0; n < 2000; ++n) {
    std::vector<std::uint8_t> message(1 + random() % longest_message);
    for (std::uint8_t& byte : message) byte = static_cast<std::uint8_t>(random() % 4 == 0 ? 0 : random());
    EXPECT_THAT(heard(reader, framed(message)), ElementsAre(message));
  }
  EXPECT_EQ(reader.broken(), 0U);
}

TEST(SerialDaqFrame, ThatIsBrokenIsDroppedAndCountedAndTheNextIsHeard) {
  FrameReader reader;
  const auto message = bytes_of("p12");
  std::string damaged = framed(message);
  damaged[2] = static_cast<char>(damaged[2] ^ 1);
  EXPECT_THAT(heard(reader, "rest of somethi" + framed(message).substr(3)), IsEmpty()) << "not ours to count";
  EXPECT_EQ(reader.broken(), 0U);
  EXPECT_THAT(heard(reader, damaged + framed(message)), ElementsAre(message));
  EXPECT_EQ(reader.broken(), 1U);
  EXPECT_THAT(heard(reader, std::string(500, 'x') + '\0' + framed(message)), ElementsAre(message));
  EXPECT_EQ(reader.broken(), 2U);
}

int fuzzed_daq_frames() {
  const char* wish = std::getenv("EMTB_FUZZED_FRAMES");
  return wish != nullptr ? std::atoi(wish) : 200'000;
}

TEST(SerialDaqFrame, NoiseIsNeverTakenForAMessageMoreOftenThanItsCrcAllows) {
  std::mt19937 random(11);
  FrameReader reader;
  const std::string real = framed(ask_samples(5000));
  const int frames = fuzzed_daq_frames();
  int taken = 0;
  for (int n = 0; n < frames; ++n) {
    std::string frame = real;
    const std::size_t changes = 2 + random() % 4;
    for (std::size_t k = 0; k < changes; ++k) frame[random() % frame.size()] = static_cast<char>(random());
    reader.feed(frame, [&](std::span<const std::uint8_t> message) {
      EXPECT_LE(message.size(), longest_message);
      read_hello(message);
      read_sample(message);
      if (!std::ranges::equal(message, ask_samples(5000))) ++taken;
    });
  }
  EXPECT_LE(taken, 10 + frames / 10'000) << "one in 65536";
}

TEST(SerialDaqMessage, IsReadOnlyWhereItIsWhole) {
  EXPECT_FALSE(read_hello(bytes_of("H123456")));
  EXPECT_FALSE(read_sample(bytes_of("D123456789012345678")));
  EXPECT_FALSE(read_sample(bytes_of("E1234567890123456789")));
  const auto hello = read_hello(std::array<std::uint8_t, 11>{'H', 1, 255, 0, 255, 3, 200, 0, 'u', 7, 'n'});
  ASSERT_TRUE(hello);
  EXPECT_EQ(hello->analog_top, 1023);
  EXPECT_EQ(hello->name, "un");
  const auto sample =
      read_sample(std::array<std::uint8_t, 20>{'D', 1, 2, 1, 0xFF, 0xFF, 1, 0, 0, 128, 7, 0, 1, 0, 4, 3, 0, 0, 0, 0});
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->number, 0x0201);
  EXPECT_TRUE(sample->watchdog);
  EXPECT_EQ(sample->duty, -1);
  EXPECT_EQ(sample->counts, 0x80000001U);
  EXPECT_EQ(sample->micros, 0x10007U);
  EXPECT_EQ(sample->analog[0], 0x0304);
}

// ---- The driver, against the sketch

class SerialDaqBoard : public ::testing::Test {
 protected:
  void open(const std::string& more = "", const std::string& reference = "full_duty: 6") {
    bench = opened_bench("min: -6, max: 6, safe: 0, " + reference, "driver: serial_daq, port: " + desk.port() + more,
                         channels);
  }
  std::string refusal(const std::string& more = "", const std::string& reference = "full_duty: 6") {
    const std::string all = refusal_of([&] { open(more, reference); });
    const std::size_t yaml = all.find(".yaml:");
    return yaml == std::string::npos ? all : all.substr(yaml + 1);
  }
  InputDevice& input() { return *bench.inputs.at(0); }
  AnalogOutput& output() { return *bench.reference; }

  std::string channels =
      "omega: {from: encoder}, theta: {from: encoder}, i_a: {from: A0, scale: 20, offset: -10}, e_a: {from: pwm}";
  const std::string usual = ", counts: 2000, bus: {from: A1, scale: 25}";
  std::atomic<int> spoilt = 0;  // frames; the desk counts on for as long as it lives
  Desk desk;
  Bench bench;
};

TEST_F(SerialDaqBoard, GivesWhatTheMotorDoes) {
  open(usual);
  DeviceLog log(input());
  log.begin();
  EXPECT_EQ(output().set(3), Fault::none);  // duty 0.5, 6 V
  ASSERT_TRUE(log.comes([&] { return log.readings.size() > 900; }));
  EXPECT_NEAR(desk.duty(), 0.5, 0.01);
  EXPECT_NEAR(log.last(Signal::omega), desk.omega(), 3) << "0.6 rad/s a count";
  EXPECT_GT(desk.omega(), 100);
  EXPECT_NEAR(log.last(Signal::i_a), desk.current(), 0.1);
  EXPECT_NEAR(log.last(Signal::e_a), 6, 0.1);
  EXPECT_THAT(log.faults, IsEmpty());
  log.expect_all_in_order(Signal::theta);
  EXPECT_EQ(input().channels()[0].window, 0.005);
  EXPECT_EQ(output().set(-3), Fault::none);
  EXPECT_TRUE(log.comes([&] { return log.last(Signal::omega) < -100 && log.last(Signal::e_a) < -5.9; }));
}

TEST_F(SerialDaqBoard, AGearAndLeadsThatAreSwappedCount) {
  open(", counts: -2000, gear: 10, bus: {volts: 12}");
  DeviceLog log(input());
  log.begin();
  output().set(3);
  ASSERT_TRUE(log.comes([&] { return log.readings.size() > 900; }));
  EXPECT_NEAR(log.last(Signal::omega), -desk.omega() / 10, 0.3);
}

TEST_F(SerialDaqBoard, ClampsItsOutputAndIsSafeWhenItIsClosed) {
  open(usual);
  EXPECT_EQ(output().set(60), Fault::none);
  EXPECT_TRUE(eventually([&] { return desk.duty() == 1; }, 10));
  EXPECT_EQ(output().set(-60), Fault::none);
  EXPECT_TRUE(eventually([&] { return desk.duty() == -1; }, 10));
  EXPECT_EQ(output().set(std::nan("")), Fault::non_finite);
  EXPECT_TRUE(eventually([&] { return desk.duty() == 0; }, 10));
  output().set(6);
  EXPECT_TRUE(eventually([&] { return desk.duty() == 1; }, 10));
  std::this_thread::sleep_for(std::chrono::milliseconds(400));
  // On a machine that stood still for 0.2 s the watchdog has bitten, and that was said.
  EXPECT_TRUE(desk.duty() == 1 || output().set(6) == Fault::output_failed) << "the watchdog is kept content";
  bench = {};
  EXPECT_TRUE(eventually([&] { return desk.duty() == 0; }, 10));
  EXPECT_FALSE(desk.dropped()) << "it was told so";
}

TEST_F(SerialDaqBoard, FramesThatAreLostOrDamagedAreAGap) {
  open(usual);
  DeviceLog log(input());
  log.begin();
  ASSERT_TRUE(log.comes([&] { return log.readings.size() > 100; }));
  log.begin();
  ASSERT_TRUE(log.comes([&] { return log.readings.size() > 100; }));
  desk.spoil([&](const std::string& frame) {
    const int n = spoilt++;
    std::string damaged = frame;
    damaged[3] = static_cast<char>(damaged[3] ^ 0x40);
    return n < 4 ? std::string() : n < 7 ? damaged : frame;
  });
  ASSERT_TRUE(log.comes([&] { return spoilt > 50; }));
  log.look_for(0.1);
  std::uint64_t longest = 0;
  const Reading* before = nullptr;
  for (const Reading& reading : log.readings) {
    if (reading.signal != Signal::theta) continue;
    if (before != nullptr) longest = std::max(longest, reading.sequence - before->sequence);
    before = &reading;
  }
  EXPECT_EQ(longest, 8U) << "7 are missing";
  EXPECT_THAT(log.faults, IsEmpty());
}

TEST_F(SerialDaqBoard, ALineThatDamagesManyFramesIsAFault) {
  open(usual);
  DeviceLog log(input());
  log.begin();
  desk.spoil([&](const std::string& frame) {
    std::string damaged = frame;
    if (++spoilt % 3 == 0) damaged[4] = static_cast<char>(damaged[4] ^ 0x11);
    return damaged;
  });
  ASSERT_TRUE(log.comes([&] { return log.faults.count(Fault::scan_broken) > 0; }));
  desk.spoil({});
  EXPECT_TRUE(log.comes([&] { return log.fault == Fault::none; }));
}

TEST_F(SerialDaqBoard, ThatFallsSilentIsLostUntilItTalksAgain) {
  open(usual);
  DeviceLog log(input());
  log.begin();
  ASSERT_TRUE(log.comes([&] { return !log.readings.empty(); }));
  desk.spoil([](const std::string&) { return std::string(); });
  ASSERT_TRUE(log.comes_fault(Fault::device_lost));
  EXPECT_EQ(output().set(1), Fault::output_failed);
  desk.spoil({});
  EXPECT_TRUE(log.comes([&] { return log.fault == Fault::none && output().make_safe() == Fault::none; }));
}

TEST_F(SerialDaqBoard, WhoseCableIsPulledDropsThePwmByItselfAndReturns) {
  open(usual);
  DeviceLog log(input());
  log.begin();
  output().set(6);
  ASSERT_TRUE(log.comes([&] { return desk.duty() == 1; }));
  desk.unplug();
  ASSERT_TRUE(log.comes_fault(Fault::device_lost));
  EXPECT_TRUE(eventually([&] { return desk.duty() == 0; }, 10)) << "its watchdog";
  output().make_safe();
  desk.plug();
  log.readings.clear();
  EXPECT_TRUE(log.comes([&] { return log.fault == Fault::none && !log.readings.empty(); }));
  EXPECT_EQ(desk.duty(), 0);
}

TEST_F(SerialDaqBoard, ThatHearsNothingDropsThePwmAndSaysSo) {
  open(usual);
  DeviceLog log(input());
  log.begin();
  output().set(6);
  ASSERT_TRUE(log.comes([&] { return desk.duty() == 1; }));
  desk.make_deaf(true);
  ASSERT_TRUE(log.comes([&] { return output().set(6) == Fault::output_failed; }));
  EXPECT_TRUE(eventually([&] { return desk.duty() == 0; }, 10)) << "its watchdog";
  output().make_safe();
  desk.make_deaf(false);
  EXPECT_TRUE(log.comes([&] { return output().make_safe() == Fault::none && output().set(0) == Fault::none; }));
}

TEST_F(SerialDaqBoard, ThatIsResetIsAFaultAndGoesOn) {
  open(usual);
  DeviceLog log(input());
  log.begin();
  ASSERT_TRUE(log.comes([&] { return !log.readings.empty(); }));
  desk.reset();
  ASSERT_TRUE(log.comes([&] { return log.faults.count(Fault::scan_broken) > 0; }));
  log.readings.clear();
  EXPECT_TRUE(log.comes([&] { return !log.readings.empty() && log.fault == Fault::none; }));
}

TEST_F(SerialDaqBoard, WhereThereIsNoneOrAnotherSaysSo) {
  desk.spoil([](const std::string&) { return std::string(); });
  EXPECT_THAT(refusal(usual + ", start_up: 0.4"),
              HasSubstr("no board says hello. Is the sketch of docs/serial-daq on it, and line: 115200 its own?"));
  desk.spoil([](const std::string&) { return framed(std::array<std::uint8_t, 8>{'H', 2, 255, 0, 255, 3, 200, 0}); });
  EXPECT_THAT(refusal(usual), HasSubstr("the board speaks version 2 of the protocol, emtb version 1"));
  desk.spoil([](const std::string&) { return framed(std::array<std::uint8_t, 8>{'H', 1, 0, 0, 255, 3, 200, 0}); });
  EXPECT_THAT(refusal(usual), HasSubstr("says hello with a PWM or an analog range of nothing"));
}

TEST_F(SerialDaqBoard, EachMistakeInTheBenchFileHasItsLine) {
  EXPECT_EQ(
      refusal(", rate: 600" + usual),
      "yaml:5: devices.daq.rate is more than the line carries: at 115200 baud 432 Hz. Write less, or a faster line");
  EXPECT_EQ(refusal(", counts: 2000"),
            "yaml:5: devices.daq.bus is missing: the supply of the H bridge, {volts: 12} or {from: A1, scale: 25}");
  EXPECT_EQ(refusal(", bus: {volts: 12}"),
            "yaml:5: devices.daq.counts is missing: how many edges has a turn of the encoder?");
  EXPECT_EQ(refusal(usual, "full_duty: 0"), "yaml:3: reference.full_duty is 0, but must be above 0");
  channels = "omega: {from: A3, scale: 1}";
  EXPECT_EQ(refusal(), "yaml:5: devices.daq.channels.omega.from is `A3`. Known: A0, A1, A2, encoder, pwm");
  channels = "i_a: {from: encoder}";
  EXPECT_EQ(refusal(), "yaml:5: devices.daq.channels.i_a.from is encoder, which gives omega and theta");
  channels = "u_ref: {from: pwm}";
  EXPECT_EQ(refusal(),
            "yaml:5: devices.daq.channels.u_ref cannot be measured here. A device may give e_a, i_a, omega, theta, "
            "torque, i_f, temperature");
}

}  // namespace
}  // namespace emtb::serial_daq
