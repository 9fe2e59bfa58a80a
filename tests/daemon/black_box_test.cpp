#include "daemon/black_box.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/recorder.h"
#include "session/spec.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

using testing::HasSubstr;

class BlackBoxTest : public Scratch {
 protected:
  BlackBox::Settings settings() const {
    return {.folder = path(""),
            .channels = {{.signal = Signal::omega, .period = 1e-3, .source = "card"},
                         {.signal = Signal::i_a, .period = 0.4, .window = 0.4, .source = "meter"}},
            .attributes = {{"bench", "b"}},
            .config = "name: b\n"};
  }
  static Record glimpse(Signal signal, double at, double value) {
    return {.kind = Record::Kind::glimpse, .signal = signal, .value = value, .at = at};
  }
  static Record fault(Fault which, double at) {
    return {.kind = Record::Kind::event, .code = static_cast<std::uint16_t>(which), .at = at};
  }
};

TEST_F(BlackBoxTest, KeepsTheLastTenSecondsOfAllAndIsASessionAsAnyOther) {
  BlackBox box(settings());
  for (int n = 0; n < 60'000; ++n) {
    const double t = 500 + 1e-3 * n;
    box.take(glimpse(Signal::omega, t, n));
    if (n % 400 == 399) box.take(glimpse(Signal::i_a, t, 0.1));
  }
  box.take({.kind = Record::Kind::state, .value = static_cast<double>(LoopState::latched), .at = 559});
  box.take(fault(Fault::over_speed, 559.5));
  box.take(fault(Fault::overrun, 505));  // long ago
  const auto file = box.dump(1'700'000'000, "over_speed");
  EXPECT_THAT(file.filename(), "20231114T221320Z-blackbox.h5");
  const Session session = read_session(file);
  EXPECT_TRUE(session.complete);
  EXPECT_EQ(session.config, "name: b\n");
  EXPECT_EQ(session.attributes.at("note"), "over_speed");
  EXPECT_EQ(session.attributes.at("started_utc"), "2023-11-14T22:13:10.000Z");
  ASSERT_EQ(session.runs.size(), 1u);
  const Series& omega = session.runs[0].at(Signal::omega);
  EXPECT_NEAR(omega.t.back(), 10, 2e-3);
  EXPECT_NEAR(static_cast<double>(omega.t.size()), 10'000, 2);
  EXPECT_EQ(omega.value.back(), 59'999);
  EXPECT_NEAR(static_cast<double>(session.runs[0].at(Signal::i_a).t.size()), 25, 1);
  std::vector<int> codes;
  for (const Event& e : session.events) codes.push_back(e.code);
  EXPECT_THAT(codes, testing::UnorderedElementsAre(event_code::run, event_code::state, 101));
}

TEST_F(BlackBoxTest, WithoutAReadingThereIsNothingToTell) {
  EXPECT_TRUE(BlackBox(settings()).dump(0, "device_lost").empty());
}

TEST_F(BlackBoxTest, TheRecorderWritesItOnceAFaultWithWhatFollowed) {
  Ring ring(1 << 14);
  std::atomic<bool> failed{false};
  std::vector<std::filesystem::path> dumped;
  Recorder recorder(ring, failed, open_session, {.dumped = [&](const auto& file) { dumped.push_back(file); }},
                    {.black_box = BlackBox(settings())});
  double now = 100;
  const auto live = [&](double seconds) {
    for (const double until = now + seconds; now < until; now += 1e-3) {
      ring.push(glimpse(Signal::omega, now, 1));
      recorder.work(now);
    }
  };
  live(1);
  ring.push(fault(Fault::terminated, now));
  live(1);
  EXPECT_TRUE(dumped.empty()) << "the end of a daemon at rest is no accident";
  ring.push(fault(Fault::stale_signal, now));
  ring.push(fault(Fault::device_lost, now));
  live(1);
  ASSERT_EQ(dumped.size(), 1u);
  const Session session = read_session(dumped[0]);
  const auto event = std::ranges::find(session.events, 202, &Event::code);
  ASSERT_NE(event, session.events.end());
  EXPECT_NEAR(event->t, 2, 5e-3);
  EXPECT_NEAR(session.runs.at(0).at(Signal::omega).t.back(), 2.5, 0.01) << "half a second of what followed";

  ring.push(fault(Fault::over_speed, now));
  recorder.work(now);
  recorder.finish();  // the process ends before that half second is over
  EXPECT_EQ(dumped.size(), 2u);
}

}  // namespace
}  // namespace emtb
