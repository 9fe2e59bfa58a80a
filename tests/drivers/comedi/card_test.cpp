#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <functional>

#include "drivers/comedi/open.h"
#include "drivers/connected.h"
#include "drivers/registry.h"
#include "hal/error.h"
#include "tests/drivers/comedi/card_file.h"
#include "tests/drivers/device_log.h"
#include "tests/drivers/opened_bench.h"
#include "tests/temporary_file.h"

namespace emtb::comedi {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double step_of_output = 20.0 / Card::top;  // [V]

/// The driver and the real libcomedi on a card, as far as their system calls can tell.
class ComediCard : public ::testing::Test {
 protected:
  /// The device of a bench file, in which `more` has been added to the card and to the reference.
  void open(const std::string& more = "", const std::string& reference = "") {
    bench = opened_bench("min: 0, max: 6, safe: 0.5" + reference, "driver: comedi, device: " + card.node() + more,
                         channels);
  }
  std::string refusal(const std::string& more = "", const std::string& reference = "") {
    return refusal_of([&] { open(more, reference); });
  }
  InputDevice& input() { return *bench.inputs.at(0); }
  AnalogOutput& output() { return *bench.reference; }

  std::string channels =
      "omega: {channel: 0, range: 10, scale: 20}, torque: {channel: 9, range: 5, scale: 0.2, offset: -0.1}, "
      "e_a: {channel: 2, wiring: differential, scale: 13}";
  CardFile card;
  Bench bench;
};

TEST_F(ComediCard, GivesReadingsInUnitsAtTheTimesOfItsOwnClock) {
  card->inputs[0] = 5;
  card->inputs[9] = 1;
  card->inputs[2] = 3;
  card->inputs[10] = 1;  // the other lead of differential channel 2
  open();
  EXPECT_EQ(card->commands, 0U) << "nothing runs before start()";
  DeviceLog log(input());
  log.begin();
  ASSERT_TRUE(log.comes([&] { return log.readings.size() >= 300; }));
  EXPECT_THAT(log.faults, IsEmpty());
  EXPECT_NEAR(log.last(Signal::omega), 100, 20 * 20.0 / 4095);
  EXPECT_NEAR(log.last(Signal::torque), 0.1, 0.2 * 10.0 / 4095);
  EXPECT_NEAR(log.last(Signal::e_a), 26, 13 * 20.0 / 4095);
  EXPECT_LT(MonotonicClock().now() - log.expect_all_in_order(Signal::omega), 2);
  EXPECT_NEAR(input().channels()[0].period, 0.005, 0.2e-6) << "whole conversions";
  EXPECT_EQ(card->commands, 1U);
}

TEST_F(ComediCard, IsToldTheScanAsTheBenchFileSays) {
  open(", rate: 3000");
  DeviceLog log(input());
  log.begin();
  ASSERT_TRUE(log.comes([&] { return !log.readings.empty(); }));
  EXPECT_EQ(card->list[0], CR_PACK(0U, 0U, AREF_GROUND));
  EXPECT_EQ(card->list[1], CR_PACK(9U, 1U, AREF_GROUND)) << "the range of 5 V";
  EXPECT_EQ(card->list[2], CR_PACK(2U, 0U, AREF_DIFF));
  EXPECT_EQ(card->scan_period, 333450U) << "[ns] three conversions of 111.15 us, as its clock of 20 MHz can";
  EXPECT_DOUBLE_EQ(input().channels()[0].period, 333450e-9) << "what the card does, not what was asked for";
}

TEST_F(ComediCard, OfWideSamplesIsReadAsWell) {
  card->wide = true;
  card->inputs[0] = 5;
  open();
  DeviceLog log(input());
  log.begin();
  ASSERT_TRUE(log.comes([&] { return log.readings.size() >= 30; }));
  EXPECT_NEAR(log.last(Signal::omega), 100, 20 * 20.0 / 4095);
}

TEST_F(ComediCard, LosesNothingOfAFastScan) {
  card->buffer = 1U << 20U;  // a second; a busy machine stalls
  open(", rate: 60000");     // 180 kS/s
  std::array<Reading, 4096> buffer{};
  input().start();
  std::array<std::uint64_t, signal_count> next{};
  std::size_t count = 0;
  ASSERT_TRUE(eventually([&] {
    for (Readings got = input().read(buffer); got.count > 0; got = input().read(buffer)) {
      EXPECT_EQ(got.fault, Fault::none);
      for (std::size_t k = 0; k < got.count; ++k) EXPECT_EQ(buffer[k].sequence, next[index(buffer[k].signal)]++);
      count += got.count;
    }
    return count > 100'000;
  }));
}

TEST_F(ComediCard, AnOverrunIsAFaultAndAGapAndNeverSpliced) {
  card->buffer = 2048;
  open(", rate: 2000");  // the buffer holds a sixth of a second
  DeviceLog log(input());
  log.begin();
  ASSERT_TRUE(log.comes([&] { return log.readings.size() > 300; }));
  card->away = 400;  // far from the second that counts as silence, on a busy machine as well
  ASSERT_TRUE(log.comes_fault(Fault::samples_lost));
  card->inputs[0] = 2;
  ASSERT_TRUE(log.comes([&] { return log.last(Signal::omega) > 39 && log.fault == Fault::none; }));
  const DeviceLog::Gap gap = log.longest_gap(Signal::omega);
  EXPECT_GT(gap.seconds, 0.1);
  EXPECT_NEAR(static_cast<double>(gap.numbers), gap.seconds * 2000, 2) << "the gap is as long as the time";
}

TEST_F(ComediCard, AScanThatEndsOrFallsSilentBeginsAnew) {
  open();
  DeviceLog log(input());
  log.begin();
  const std::vector<std::function<void()>> mishaps{[&] { ++card->ends; }, [&] { card->silent = true; }};
  for (const auto& mishap : mishaps) {
    ASSERT_TRUE(log.comes([&] { return !log.readings.empty() && log.fault == Fault::none; }));
    log.readings.clear();
    mishap();
    ASSERT_TRUE(log.comes_fault(Fault::scan_broken));
    card->silent = false;
  }
  EXPECT_TRUE(log.comes([&] { return !log.readings.empty() && log.fault == Fault::none; }));
  EXPECT_GE(card->commands, 3U);
}

TEST_F(ComediCard, AnInputAtTheEndOfItsRangeIsAFaultAndNoReading) {
  open();
  DeviceLog log(input());
  log.begin();
  ASSERT_TRUE(log.comes([&] { return !log.readings.empty(); }));
  card->inputs[9] = 5.5;  // range 5
  ASSERT_TRUE(log.comes_fault(Fault::over_range));
  log.readings.clear();
  log.look_for(0.1);
  for (const Reading& reading : log.readings) EXPECT_NE(reading.signal, Signal::torque);
  card->inputs[9] = 4.5;
  EXPECT_TRUE(log.comes([&] { return log.fault == Fault::none && log.last(Signal::torque) > 0.79; }));
}

TEST_F(ComediCard, ThatGoesIsLostAndReturns) {
  open();
  DeviceLog log(input());
  log.begin();
  ASSERT_TRUE(log.comes([&] { return !log.readings.empty(); }));
  output().set(5);
  ASSERT_TRUE(eventually([&] { return card->output(0) > 4.9; }));
  card->present = false;  // its driver is unloaded
  ASSERT_TRUE(log.comes_fault(Fault::device_lost));
  ASSERT_TRUE(eventually([&] { return output().make_safe() == Fault::output_failed; }));
  card->present = true;
  log.readings.clear();
  EXPECT_TRUE(log.comes([&] { return !log.readings.empty() && log.fault == Fault::none; }));
  EXPECT_TRUE(eventually([&] { return output().make_safe() == Fault::none; }));
  EXPECT_NEAR(card->output(0), 0.5, step_of_output);
}

TEST_F(ComediCard, ClampsItsOutputBelowEveryCaller) {
  open();
  EXPECT_NEAR(card->output(0), 0.5, step_of_output) << "safe once it is open";
  const auto set = [&](double volts, double at) {
    EXPECT_EQ(output().set(volts), Fault::none);
    return eventually([&] { return std::abs(card->output(0) - at) < step_of_output; });
  };
  EXPECT_TRUE(set(6, 6));
  EXPECT_TRUE(set(3, 3));
  EXPECT_TRUE(set(60, 6));
  EXPECT_TRUE(set(-5, 0));
  EXPECT_TRUE(set(2, 2));
  EXPECT_EQ(output().set(std::nan("")), Fault::non_finite);
  EXPECT_TRUE(eventually([&] { return std::abs(card->output(0) - 0.5) < step_of_output; })) << "the safe value";
  EXPECT_LE(card.highest(), 3276U) << "6 V";
  EXPECT_EQ(card->outputs[1], 2048U) << "the other is left alone";
}

TEST_F(ComediCard, IsMadeSafeWhenItIsClosedWhateverItHeld) {
  open();
  EXPECT_EQ(output().set(6), Fault::none);
  ASSERT_TRUE(eventually([&] { return card->output(0) > 5.9; }));
  DeviceLog log(input());
  log.begin();
  ASSERT_TRUE(log.comes([&] { return !log.readings.empty(); }));
  bench = {};
  EXPECT_NEAR(card->output(0), 0.5, step_of_output);
  EXPECT_EQ(card->scanning, 0) << "and its scan is over";
}

TEST_F(ComediCard, AnOutputThatFailsOrReadsBackOtherwiseSaysSo) {
  open();
  card->refuses = true;
  output().set(3);
  ASSERT_TRUE(eventually([&] { return output().set(3) == Fault::output_failed; }));
  card->refuses = false;
  ASSERT_TRUE(eventually([&] { return output().set(3) == Fault::none && card->output(0) > 2.9; }));
  const std::uint32_t before = card->written;
  card->outputs[0] = 4095;  // another program
  ASSERT_TRUE(eventually([&] { return output().set(3) == Fault::output_failed; }));
  EXPECT_TRUE(eventually([&] { return card->written > before && card->output(0) < 3.1; })) << "and is told again";
}

TEST_F(ComediCard, ThatDoesNotTellItsOutputIsUsedOnRequest) {
  card->tells = false;
  EXPECT_THAT(refusal(), HasSubstr("daq: " + card.node() + " (pci-6024e): reading channel 0: "));
  EXPECT_THAT(refusal(), HasSubstr("If it cannot be read back, write read_back: false under reference"));
  open("", ", read_back: false");
  EXPECT_EQ(output().set(3), Fault::none);
  EXPECT_TRUE(eventually([&] { return std::abs(card->output(0) - 3) < step_of_output; }));
}

TEST_F(ComediCard, InUseByAnotherProgramIsMadeSafeAllTheSame) {
  open();
  DeviceLog log(input());
  log.begin();
  ASSERT_TRUE(log.comes([&] { return !log.readings.empty(); }));
  output().set(6);
  ASSERT_TRUE(eventually([&] { return card->output(0) > 5.9; }));
  const TemporaryFile file(".yaml",
                           "name: b\nreference: {device: daq, min: 0, max: 6, safe: 0}\ndevices:\n  daq: {driver: "
                           "comedi, device: " +
                               card.node() + ", channels: {" + channels + "}}\n");
  const BenchConfig config = read_bench(file.path());
  const std::uint32_t before = card->written;
  open_reference(config);
  EXPECT_EQ(card->codes[before], 2048U) << "0 V";
  const BenchInputs inputs = open_inputs(config);
  EXPECT_THAT(inputs.devices.at(0).why_not, HasSubstr("another program uses it. Close that one"));
}

TEST_F(ComediCard, IsRefusedWithOneLineWhereItCannotDoWhatIsAsked) {
  EXPECT_THAT(refusal(", board: pci-1711"), HasSubstr("(pci-6024e): the bench file expects a pci-1711. Name another"));
  EXPECT_THAT(refusal("", ", channel: 2"), HasSubstr("has no channel 2 there, only 0 to 1"));
  EXPECT_THAT(refusal(", rate: 90000"), HasSubstr("cannot scan 3 channels at 90000 Hz, only at 66667 Hz"));
  channels = "e_a: {channel: 0, range: 12}";
  EXPECT_THAT(refusal(), HasSubstr("no range of channel 0 holds -12 to 12 V. It has -10 to 10, -5 to 5, -0.5 to 0.5, "
                                   "-0.05 to 0.05 V"));
  channels = "e_a: {channel: 9, wiring: differential}";
  EXPECT_THAT(refusal(), HasSubstr("takes no scan of these channels at this rate"));
  channels = "e_a: {channel: 0}";
  card->rounds_up = true;
  EXPECT_THAT(refusal(", rate: 300"),
              HasSubstr("cannot scan 1 channels at 300 Hz, only at 250 Hz. Write another rate"));
  card->scans = false;
  EXPECT_THAT(refusal(), HasSubstr("cannot scan by its own clock (its driver knows no commands)"));
  card->present = false;
  EXPECT_THAT(refusal(), HasSubstr("has no card behind it. Load its kernel driver"));
}

TEST_F(ComediCard, IsListedByItsNodeAndBoard) {
  const auto line = [&] {
    for (const auto& [what, entry] : connected_devices(card.folder())) return what + ": " + entry;
    return std::string("none");
  };
  EXPECT_EQ(line(), "pci-6024e: driver: comedi, device: " + card.node() + ", board: pci-6024e");
  card->present = false;
  EXPECT_EQ(line(), "comedi node: " + card.node() + ": no card behind it, or not ours to open (group iocard)");
}

}  // namespace
}  // namespace emtb::comedi
