#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "daemon/loop.h"
#include "daemon/recorder.h"
#include "session/session.h"
#include "session/spec.h"
#include "tests/faulty_device.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

constexpr double sweep_period = 1e-3;  // [s]

/// When something fails.
enum class Moment { start, latched, armed, running, stopping };
constexpr std::array moments{Moment::start, Moment::latched, Moment::armed, Moment::running, Moment::stopping};
constexpr std::array<const char*, 5> moment_names{"AtStart", "Latched", "Armed", "Running", "Stopping"};

/// One way in which one call of the hal fails.
struct Failing {
  const char* name;
  void (*fail)(FaultyBench&);
  Fault fault;
  double patience = 0;        // [s] until it can be known, beyond the period in which it is called
  bool while_armed = true;    // the call is made in these moments, too
  bool while_running = true;  // and in the run, and at its end
  bool output_works = true;   // the reference obeys make_safe()
};

const std::array failings{
    Failing{"CardReadFails", [](FaultyBench& b) { b.card->failure = Failure::error; }, Fault::device_lost},
    Failing{"CardReadTimesOut", [](FaultyBench& b) { b.card->failure = Failure::time_out; }, Fault::stale_signal},
    Failing{"CardReadsNaN", [](FaultyBench& b) { b.card->failure = Failure::nan; }, Fault::non_finite},
    Failing{"CardReadsInfinity", [](FaultyBench& b) { b.card->failure = Failure::infinite; }, Fault::non_finite},
    Failing{"CardStalls", [](FaultyBench& b) { b.card->failure = Failure::stall; }, Fault::stale_signal, 0.26},
    Failing{"CardDisappears", [](FaultyBench& b) { b.card->failure = Failure::gone; }, Fault::device_lost},
    Failing{"CardRefusesToStart", [](FaultyBench& b) { b.card->failure = Failure::refused; }, Fault::device_lost, 0,
            false, false},
    Failing{"CardsClockIsAhead", [](FaultyBench& b) { b.card->failure = Failure::ahead; }, Fault::device_clock},
    Failing{"MeterReadFails", [](FaultyBench& b) { b.meter->failure = Failure::error; }, Fault::device_lost},
    Failing{"MeterReadTimesOut", [](FaultyBench& b) { b.meter->failure = Failure::time_out; }, Fault::stale_signal},
    Failing{"MeterReadsNaN", [](FaultyBench& b) { b.meter->failure = Failure::nan; }, Fault::non_finite},
    Failing{"MeterStalls", [](FaultyBench& b) { b.meter->failure = Failure::stall; }, Fault::stale_signal, 0.26},
    Failing{"MeterDisappears", [](FaultyBench& b) { b.meter->failure = Failure::gone; }, Fault::device_lost},
    Failing{"OutputRefusesValues", [](FaultyBench& b) { b.output->fail_set = Fault::output_failed; },
            Fault::output_failed},
    Failing{"OutputDisappears", [](FaultyBench& b) { b.output->fail_set = b.output->fail_safe = Fault::device_lost; },
            Fault::device_lost, 0, true, true, false},
};

void PrintTo(const Failing& failing, std::ostream* out) { *out << failing.name; }

/// The loop on fakes, and the recorder with real files.
class EveryCallFails : public Scratch, public testing::WithParamInterface<std::tuple<Failing, Moment>> {
 protected:
  EveryCallFails() {
    std::vector<Channel> channels{{.signal = Signal::u_ref, .period = sweep_period, .source = "commanded"}};
    for (const auto& input : faulty.bench.inputs) {
      channels.insert(channels.end(), input->channels().begin(), input->channels().end());
    }
    description.channels = channels;
    recorder = std::make_unique<Recorder>(
        ring, mailbox.recorder_failed, open_session,
        Recorder::Listeners{.dumped = [this](const std::filesystem::path& file) { black_boxes.push_back(file); }},
        Recorder::Surroundings{.black_box = BlackBox({.folder = path(""), .channels = channels})});
    loop = std::make_unique<Loop>(
        faulty.bench,
        Loop::Settings{.limits = {.omega = 190}, .reference = {.min = 0, .max = 6, .safe = 0}, .period = sweep_period},
        mailbox, live, ring);
  }

  void tick(double seconds = sweep_period) {
    for (int n = static_cast<int>(std::lround(seconds / sweep_period)); n > 0; --n) {
      if (loop->wanted()) loop->prepare();
      faulty.clock->sleep_until(faulty.clock->now() + sweep_period);
      loop->tick(faulty.clock->now());
      if (n % 50 == 0) recorder->work(faulty.clock->now());
    }
  }
  void reset() {
    ++mailbox.resets;
    tick(2 * sweep_period);
  }
  void run() {
    recorder->open(path("run.h5"), description, "level");
    mailbox.run = &order;
    tick(0.1);
    ASSERT_EQ(live.state, LoopState::running);
    ASSERT_EQ(faulty.output->volts, 3);
  }

  FaultyBench faulty;
  Mailbox mailbox;
  Live live;
  Ring ring{1 << 16};
  SessionWriter::Description description;
  std::vector<std::filesystem::path> black_boxes;
  std::unique_ptr<Recorder> recorder;
  std::unique_ptr<Loop> loop;
  const Order order{1, Profile("level", {{0, 3}, {5, 3}})};
};

TEST_P(EveryCallFails, LatchedSafeNamedAndReadableWithinOnePeriod) {
  const auto& [failing, moment] = GetParam();
  if (moment == Moment::start) failing.fail(faulty);
  loop->start();
  tick(5 * sweep_period);
  const bool idle = moment == Moment::start || moment == Moment::latched;
  const bool in_run = moment == Moment::running || moment == Moment::stopping;
  if (!idle) {
    reset();
    ASSERT_EQ(live.state, LoopState::armed);
  }
  if (in_run) run();
  if (moment != Moment::start) failing.fail(faulty);
  if (moment == Moment::stopping) ++mailbox.stops;
  tick(sweep_period + failing.patience);
  if (idle) {  // what is not called while it is latched shows when somebody wants to arm
    EXPECT_EQ(live.state, LoopState::latched);
    reset();
    tick(failing.patience);
  }
  EXPECT_EQ(live.state, LoopState::latched);
  EXPECT_EQ(live.fault, failing.fault) << text(live.fault);
  if (failing.output_works) {
    EXPECT_EQ(faulty.output->volts, 0) << "the reference must be safe";
  } else {
    EXPECT_TRUE(live.output_broken) << "and where it cannot be made safe, that is said";
    EXPECT_GE(faulty.output->safes, 1);
  }
  tick(1);  // the last readings, and the black box's aftermath
  recorder->work(faulty.clock->now());
  EXPECT_FALSE(loop->busy());

  const auto tells = [&](const Session& session) {
    return std::ranges::any_of(session.events,
                               [&](const Event& e) { return e.code == static_cast<int>(failing.fault); });
  };
  if (in_run) {
    const Session session = read_session(path("run.h5"));
    EXPECT_TRUE(session.complete);
    ASSERT_EQ(session.runs.size(), 1u);
    const Series& u = session.runs[0].at(Signal::u_ref);
    EXPECT_NEAR(u.t.back(), 0.1, failing.patience + 3 * sweep_period);
    EXPECT_EQ(u.value.back(), 0) << "as it was set at the end";
    EXPECT_TRUE(moment == Moment::stopping || tells(session));
  }
  ASSERT_FALSE(black_boxes.empty());
  EXPECT_TRUE(tells(read_session(black_boxes.front())));
}

std::vector<std::tuple<Failing, Moment>> sweep() {
  std::vector<std::tuple<Failing, Moment>> all;
  for (const Failing& failing : failings) {
    for (const Moment moment : moments) {
      if (moment == Moment::armed && !failing.while_armed) continue;
      if ((moment == Moment::running || moment == Moment::stopping) && !failing.while_running) continue;
      all.emplace_back(failing, moment);
    }
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(Hal, EveryCallFails, testing::ValuesIn(sweep()), [](const auto& test) {
  return std::string(std::get<0>(test.param).name) + moment_names[static_cast<std::size_t>(std::get<1>(test.param))];
});

}  // namespace
}  // namespace emtb
