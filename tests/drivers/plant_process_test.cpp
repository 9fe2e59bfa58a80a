#include "drivers/simulated/plant_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <mutex>
#include <thread>

#include "drivers/registry.h"
#include "drivers/simulated/remote.h"
#include "hal/error.h"
#include "tests/drivers/opened_bench.h"
#include "tests/plant_bench.h"
#include "tests/process.h"
#include "tests/temporary_file.h"

namespace emtb::simulated {
namespace {

using testing::HasSubstr;

BenchConfig remote_bench(const std::string& text) {
  const TemporaryFile file(".yaml", text);
  return read_bench(file.path());
}

/// A plant at work beside the test, and what it saw of its reference.
class LivingPlant {
 public:
  explicit LivingPlant(const BenchConfig& bench) : plant_(bench) {
    thread_ = std::thread([this] {
      plant_.run(quit_, [this](double, double volts) {
        const std::lock_guard lock(mutex_);
        seen_ = volts;
      });
    });
  }
  ~LivingPlant() { end(); }
  void end() {
    quit_ = true;
    if (thread_.joinable()) thread_.join();
  }
  double reference() {  // [V]
    const std::lock_guard lock(mutex_);
    return seen_;
  }

 private:
  PlantProcess plant_;
  std::atomic<bool> quit_{false};
  std::mutex mutex_;
  double seen_ = -1;
  std::thread thread_;
};

std::string remote_refusal(const std::string& text) {
  return refusal_of([&] { open_bench(remote_bench(text)); });
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(RemotePlant, TurnsUnderTheReferenceThatItIsGivenAndReportsInOrder) {
  const PlantName name;
  const BenchConfig config = remote_bench(name.bench());
  LivingPlant plant(config);
  Bench bench = open_bench(config);
  ASSERT_EQ(bench.inputs.size(), 1u);
  bench.inputs[0]->start();
  EXPECT_EQ(bench.reference->set(3), Fault::none);
  std::vector<Reading> all;
  const bool turns = eventually([&] {
    std::array<Reading, 500> some;
    const Readings got = bench.inputs[0]->read(some);
    EXPECT_EQ(got.fault, Fault::none);
    all.insert(all.end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(got.count));
    return !all.empty() && all.back().signal == Signal::omega && all.back().value > 250;
  });
  EXPECT_TRUE(turns) << "12 V at 0.042 V s/rad";
  std::uint64_t next = 0;
  double last = 0;
  for (const Reading& reading : all) {
    if (reading.signal != Signal::omega) continue;
    EXPECT_GE(reading.sequence, next) << "from 0 on, none twice";
    EXPECT_GT(reading.time, last);
    next = reading.sequence + 1;
    last = reading.time;
  }
  EXPECT_NEAR(last, bench.clock->now(), 1) << "stamped by the machine's own clock";
}

TEST(RemotePlant, HoldsTheReferenceWhenItsMasterIsGoneAndGoesSafeWhenTheNextOneOpensIt) {
  const PlantName name;
  const BenchConfig config = remote_bench(name.bench());
  LivingPlant plant(config);
  { open_bench(config).reference->set(2); }  // gone without a word
  ASSERT_TRUE(eventually([&] { return plant.reference() == 2; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(plant.reference(), 2) << "a card holds its output";
  const Bench next = open_bench(config);
  EXPECT_TRUE(eventually([&] { return plant.reference() == 0; })) << "safe, before anybody asks";
}

TEST(RemotePlant, ClampsAndRefusesWhatIsNoNumber) {
  const PlantName name;
  const BenchConfig config = remote_bench(name.bench());
  LivingPlant plant(config);
  const Bench bench = open_bench(config);
  bench.reference->set(99);
  EXPECT_TRUE(eventually([&] { return plant.reference() == 6; }));
  EXPECT_EQ(bench.reference->set(std::nan("")), Fault::non_finite);
  EXPECT_TRUE(eventually([&] { return plant.reference() == 0; }));
}

TEST(RemotePlant, APlantThatEndsIsALostDevice) {
  const PlantName name;
  const BenchConfig config = remote_bench(name.bench());
  auto plant = std::make_unique<LivingPlant>(config);
  const Bench bench = open_bench(config);
  bench.inputs[0]->start();
  plant.reset();
  std::array<Reading, 64> some;
  EXPECT_EQ(bench.inputs[0]->read(some).fault, Fault::device_lost);
  EXPECT_EQ(bench.reference->set(1), Fault::device_lost);
  EXPECT_EQ(bench.reference->make_safe(), Fault::device_lost) << "nobody is there to obey";
  EXPECT_THROW(bench.inputs[0]->start(), DeviceError);

  const LivingPlant second(config);  // the next one lives in the same place
  bench.inputs[0]->start();
  EXPECT_EQ(bench.reference->make_safe(), Fault::none);
  EXPECT_TRUE(eventually([&] { return bench.inputs[0]->read(some).count > 0; }));
}

TEST(RemotePlant, AReaderThatWasAwayGoesOnWithNewerReadingsAndTheNumbersTellTheGap) {
  auto device = std::make_unique<PlantPort::Device>();
  for (std::uint64_t n = 0; n < PlantPort::ring_size + 10; ++n) {
    device->publish({.signal = Signal::omega, .time = 1e-3 * static_cast<double>(n), .value = 1, .sequence = n});
  }
  EXPECT_FALSE(device->reading(9)) << "written over";
  ASSERT_TRUE(device->reading(10));
  EXPECT_EQ(device->reading(10)->sequence, 10u);
  EXPECT_FALSE(device->reading(PlantPort::ring_size + 10)) << "not written yet";
}

TEST(RemotePlant, SaysInOneLineWhatIsWrong) {
  const PlantName name;
  EXPECT_THAT(remote_refusal(name.bench()), HasSubstr("no plant answers there"));
  EXPECT_THAT(remote_refusal(replaced(name.bench(), name.text(), "../x")), HasSubstr("simulation.process is `../x`"));
  EXPECT_THAT(remote_refusal(replaced(name.bench(), "simulation:\n", "simulation:\n  pace: 20\n")),
              HasSubstr("real time"));
  const BenchConfig config = remote_bench(name.bench());
  const LivingPlant plant(config);
  EXPECT_THROW(PlantProcess second(config), DeviceError) << "one plant a name";
  EXPECT_THAT(remote_refusal(replaced(name.bench(), "      i_a: {range: [-20, 20], noise: 0.01}\n", "")),
              HasSubstr("another bench file"));
}

}  // namespace
}  // namespace emtb::simulated
