#include "daemon/recorder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "hal/error.h"

namespace emtb {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// What a fake session was told; outlives the sink.
struct Written {
  std::map<Signal, std::vector<double>> t;
  std::vector<Event> events;
  int flushes = 0;
  bool finished = false;
  bool full = false;  ///< the disk
};

class FakeSink final : public SessionSink {
 public:
  explicit FakeSink(Written& written) : written_(written) {}
  void append(Signal signal, std::span<const double> t, std::span<const double>) override {
    refuse_if_full();
    written_.t[signal].insert(written_.t[signal].end(), t.begin(), t.end());
  }
  void append(const Event& event) override {
    refuse_if_full();
    written_.events.push_back(event);
  }
  void flush() override {
    refuse_if_full();
    ++written_.flushes;
  }
  void finish() override {
    refuse_if_full();
    written_.finished = true;
  }

 private:
  void refuse_if_full() const {
    if (written_.full) throw SessionError("run.h5: no space left on device");
  }
  Written& written_;
};

class RecorderTest : public testing::Test {
 protected:
  void open() { recorder.open("run.h5", {}, "step"); }
  void sample(Signal signal, double t) { ring.push({.signal = signal, .t = t, .value = 1}); }
  void end(Outcome outcome = Outcome::done, Fault fault = Fault::none) {
    ring.push({.kind = Record::Kind::end, .outcome = outcome, .code = static_cast<std::uint16_t>(fault), .t = 2});
  }

  Written written;
  Ring ring{4096};
  std::atomic<bool> failed{false};
  std::vector<Closed> closed;
  std::vector<std::string> log;
  std::vector<Event> remarks;
  std::vector<std::uint32_t> asked_for;  ///< runs
  Recorder recorder{ring,
                    failed,
                    [this](const auto&, const auto&) { return std::make_unique<FakeSink>(written); },
                    {.closed = [this](const Closed& c) { closed.push_back(c); },
                     .happened = [this](const std::string& text) { log.push_back(text); },
                     .remarks =
                         [this](std::uint32_t run) {
                           asked_for.push_back(run);
                           return std::exchange(remarks, {});
                         }}};
};

TEST_F(RecorderTest, WritesEachSignalInOrderAndFinishes) {
  open();
  EXPECT_TRUE(recorder.recording());
  for (int i = 0; i < 3; ++i) {
    sample(Signal::omega, i);
    sample(Signal::u_ref, i + 0.5);
  }
  end();
  recorder.work(0);
  EXPECT_THAT(written.t[Signal::omega], ElementsAre(0, 1, 2));
  EXPECT_THAT(written.t[Signal::u_ref], ElementsAre(0.5, 1.5, 2.5));
  EXPECT_TRUE(written.finished);
  EXPECT_FALSE(recorder.recording());
  ASSERT_EQ(closed.size(), 1u);
  EXPECT_EQ(closed[0].outcome, Outcome::done);
  ASSERT_EQ(written.events.size(), 2u);
  EXPECT_EQ(written.events[0].code, event_code::run);
  EXPECT_EQ(written.events[0].text, "step");
  EXPECT_EQ(written.events[1].code, event_code::run_ended);
}

TEST_F(RecorderTest, FlushesAtLeastEveryTenthOfASecond) {
  open();
  const int before = written.flushes;
  for (int ms = 0; ms < 1000; ms += 5) recorder.work(100 + ms * 1e-3);
  EXPECT_GE(written.flushes - before, 9);
  EXPECT_LE(written.flushes - before, 11) << "a flush costs the disk something";
}

TEST_F(RecorderTest, AFaultIsAnEventWithItsNumber) {
  open();
  ring.push({.kind = Record::Kind::event, .code = 101, .signal = Signal::omega, .t = 1.5, .value = 200});
  end(Outcome::fault, Fault::over_speed);
  recorder.work(0);
  ASSERT_EQ(written.events.size(), 2u);
  EXPECT_EQ(written.events[1].code, 101);
  EXPECT_EQ(written.events[1].t, 1.5);
  EXPECT_THAT(written.events[1].text, HasSubstr("omega = 200 rad/s"));
  EXPECT_THAT(closed[0].text, HasSubstr("over_speed"));
  EXPECT_TRUE(written.finished) << "the file is whole, whatever ended the run";
}

TEST_F(RecorderTest, WhatOthersRemarkIsAnEventOfTheSessionThatIsOn) {
  open();
  remarks = {{1.5, event_code::changed, "the inertia is more than before"}};
  recorder.work(0);
  ASSERT_EQ(written.events.size(), 2u);
  EXPECT_EQ(written.events[1].code, event_code::changed);
  EXPECT_EQ(written.events[1].text, "the inertia is more than before");
  EXPECT_THAT(log, ElementsAre("the inertia is more than before"));
  EXPECT_FALSE(failed);
  end();
  recorder.work(1);
  remarks = {{2.5, event_code::changed, "too late"}};
  recorder.work(2);
  EXPECT_EQ(written.events.back().code, event_code::run_ended);
  EXPECT_EQ(log.back(), "too late");
  EXPECT_THAT(asked_for, ElementsAre(0, 0, 1)) << "the run whose session is on, or comes next";
}

TEST_F(RecorderTest, AGapIsAnEventThatSaysHowMuchIsMissing) {
  open();
  ring.push({.kind = Record::Kind::event, .code = event_code::gap, .signal = Signal::i_a, .t = 1, .value = 3});
  recorder.work(0);
  EXPECT_THAT(written.events.back().text, HasSubstr("i_a: 3 readings are missing"));
}

TEST_F(RecorderTest, AFullDiskRaisesTheFlagAndTheRunCloses) {
  open();
  written.full = true;
  sample(Signal::omega, 0);
  recorder.work(0);
  EXPECT_TRUE(failed);
  ring.push({.kind = Record::Kind::event, .code = 501, .t = 0.1});
  sample(Signal::omega, 0.1);
  end(Outcome::fault, Fault::recorder_failed);
  recorder.work(1);
  ASSERT_EQ(closed.size(), 1u);
  EXPECT_FALSE(closed[0].complete);
  EXPECT_EQ(closed[0].fault, Fault::recorder_failed);
  EXPECT_THAT(closed[0].text, HasSubstr("no space left"));
  EXPECT_FALSE(failed) << "the next run may find space";
}

TEST_F(RecorderTest, ADiskThatFillsAtTheVeryEndIsToldToo) {
  open();
  written.full = true;
  end();
  recorder.work(0);
  ASSERT_EQ(closed.size(), 1u);
  EXPECT_EQ(closed[0].outcome, Outcome::fault);
  EXPECT_FALSE(closed[0].complete);
}

TEST_F(RecorderTest, WhatIsNotTheFilesFaultEndsTheRunNamedToo) {
  open();
  sample(Signal::omega, 0);
  recorder.give_up("the memory that is free is not enough");
  EXPECT_TRUE(failed);
  end(Outcome::fault, Fault::recorder_failed);
  recorder.work(0);
  ASSERT_EQ(closed.size(), 1u);
  EXPECT_FALSE(closed[0].complete);
  EXPECT_THAT(closed[0].text, HasSubstr("recorder_failed"));
  EXPECT_THAT(closed[0].text, HasSubstr("memory"));
  recorder.give_up("again");
  EXPECT_FALSE(failed) << "without a run there is none to end";
}

TEST_F(RecorderTest, FaultsWithoutARunGoToTheLog) {
  ring.push({.kind = Record::Kind::event, .code = 301, .signal = Signal::omega});
  recorder.work(0);
  ASSERT_EQ(log.size(), 1u);
  EXPECT_THAT(log[0], HasSubstr("device_lost"));
}

TEST_F(RecorderTest, OneSessionAtATime) {
  open();
  EXPECT_THROW(open(), SessionError);
}

TEST_F(RecorderTest, TheNextRunMayBeOpenedFromTheListener) {
  open();
  end();
  recorder.work(0);
  open();
  end();
  recorder.work(1);
  EXPECT_EQ(closed.size(), 2u);
}

TEST(SessionPath, NamesTimeAndProfileAndTakesTheNextFreeOne) {
  const auto folder = std::filesystem::temp_directory_path() / ("emtb_path_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  const auto first = session_path(folder, 1700000000, "step_high");
  EXPECT_EQ(first.filename(), "20231114T221320Z-step_high.h5");
  std::FILE* file = std::fopen(first.c_str(), "w");
  std::fclose(file);
  EXPECT_EQ(session_path(folder, 1700000000, "step_high").filename(), "20231114T221320Z-step_high-2.h5");
  EXPECT_EQ(session_path(folder, 0, "../../etc/x").filename(), "19700101T000000Z-______etc_x.h5")
      << "a name is no path";
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace emtb
