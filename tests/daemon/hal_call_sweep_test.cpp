#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "daemon/loop.h"
#include "daemon/recorder.h"
#include "session/spec.h"
#include "tests/faulty_device.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

constexpr double hal_period = 1e-3;  // [s]

/// Counts the calls of each function of the hal, and makes one of them fail, once.
struct HalCalls {
  std::map<std::string, int> count;
  std::string failing;
  int nth = 0;
  const Live* live = nullptr;
  bool failed = false, failed_in_run = false;

  bool fails(const std::string& call) {
    if (++count[call] != nth || call != failing) return false;
    failed = true;
    failed_in_run = live != nullptr && live->state == LoopState::running;
    return true;
  }
};

class CountedInput final : public InputDevice {
 public:
  CountedInput(std::unique_ptr<InputDevice> inner, std::string name, HalCalls& calls)
      : inner_(std::move(inner)), name_(std::move(name)), calls_(calls) {}
  std::span<const Channel> channels() const noexcept override { return inner_->channels(); }
  void start() override {
    if (calls_.fails(name_ + ".start")) throw DeviceError("fake: does not start");
    inner_->start();
  }
  Readings read(std::span<Reading> out) noexcept override {
    return calls_.fails(name_ + ".read") ? Readings{0, Fault::device_lost} : inner_->read(out);
  }

 private:
  std::unique_ptr<InputDevice> inner_;
  std::string name_;
  HalCalls& calls_;
};

class CountedOutput final : public AnalogOutput {
 public:
  CountedOutput(std::unique_ptr<AnalogOutput> inner, HalCalls& calls) : inner_(std::move(inner)), calls_(calls) {}
  Fault set(double volts) noexcept override {
    return calls_.fails("output.set") ? Fault::output_failed : inner_->set(volts);
  }
  Fault make_safe() noexcept override {
    return calls_.fails("output.make_safe") ? Fault::output_failed : inner_->make_safe();
  }
  Limits limits() const noexcept override { return inner_->limits(); }

 private:
  std::unique_ptr<AnalogOutput> inner_;
  HalCalls& calls_;
};

/// The life of a bench: it starts, is armed, runs, and rests. On fakes, with the recorder's real files.
class HalCallFailsOnce : public Scratch {
 protected:
  struct Life {
    HalCalls calls;
    bool armed = false, told = false;
    double volts = -1;  ///< of the reference, at the end
    Fault fault = Fault::none;
    std::optional<Session> session{};
  };

  Life live_with(const std::string& failing, int nth) {
    Life life;
    life.calls.failing = failing;
    life.calls.nth = nth;
    FaultyBench faulty;
    const std::vector<std::string> names{"card", "meter"};
    std::vector<Channel> channels{{.signal = Signal::u_ref, .period = hal_period, .source = "commanded"}};
    for (std::size_t i = 0; i < names.size(); ++i) {
      auto& input = faulty.bench.inputs[i];
      channels.insert(channels.end(), input->channels().begin(), input->channels().end());
      input = std::make_unique<CountedInput>(std::move(input), names[i], life.calls);
    }
    faulty.bench.reference = std::make_unique<CountedOutput>(std::move(faulty.bench.reference), life.calls);
    Mailbox mailbox;
    Live live;
    life.calls.live = &live;
    Ring ring{1 << 16};
    Recorder recorder(ring, mailbox.recorder_failed, open_session, {},
                      {.black_box = BlackBox({.folder = path(""), .channels = channels})});
    Loop loop(
        faulty.bench,
        Loop::Settings{.limits = {.omega = 190}, .reference = {.min = 0, .max = 6, .safe = 0}, .period = hal_period},
        mailbox, live, ring);
    const auto tick = [&](int times) {
      for (int n = times; n > 0; --n) {
        if (loop.wanted()) loop.prepare();
        faulty.clock->sleep_until(faulty.clock->now() + hal_period);
        loop.tick(faulty.clock->now());
        if (n % 50 == 0) recorder.work(faulty.clock->now());
      }
    };
    loop.start();
    tick(5);
    ++mailbox.resets;
    tick(5);
    life.armed = live.state == LoopState::armed;
    const Order order{1, Profile("level", {{0, 3}, {0.2, 3}, {0.2, 0}, {0.25, 0}})};
    if (life.armed) {
      const auto file = path(failing + std::to_string(nth) + ".h5");
      recorder.open(file, {.channels = channels, .attributes = {}, .config = {}}, "level");
      mailbox.run = &order;
      tick(400);
      recorder.work(faulty.clock->now());
      life.session = read_session(file);
      life.told = std::ranges::any_of(life.session->events,
                                      [&](const Event& e) { return e.code == static_cast<int>(live.fault.load()); });
    }
    life.volts = faulty.output->volts;
    life.fault = live.fault;
    EXPECT_FALSE(loop.busy()) << failing << " " << nth;
    return life;
  }
};

TEST_F(HalCallFailsOnce, AtItsFirstItsSecondAndALateTime) {
  const Life well = live_with("", 0);
  ASSERT_TRUE(well.armed);
  ASSERT_EQ(well.fault, Fault::none);
  ASSERT_EQ(well.calls.count.size(), 6u) << "start and read of two devices, set and make_safe";
  int in_runs = 0;
  for (const auto& [call, times] : well.calls.count) {
    for (const int nth : std::set{1, std::min(2, times), times / 2, times}) {
      if (nth == 0) continue;
      const Life life = live_with(call, nth);
      const std::string what = call + ", time " + std::to_string(nth) + " of " + std::to_string(times);
      EXPECT_TRUE(life.calls.failed) << what;
      EXPECT_EQ(life.volts, 0) << "the reference is safe: " << what;
      EXPECT_TRUE(!life.session || life.session->complete) << what;
      EXPECT_TRUE(life.armed || life.fault != Fault::none) << "what is not armed says why: " << what;
      if (!life.calls.failed_in_run) continue;
      ++in_runs;
      EXPECT_NE(life.fault, Fault::none) << "a run does not go on in silence: " << what;
      EXPECT_TRUE(life.told) << "and its session tells: " << what;
    }
  }
  EXPECT_GE(in_runs, 3) << "of a run, too";
}

}  // namespace
}  // namespace emtb
