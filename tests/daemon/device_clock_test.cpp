#include "daemon/device_clock.h"

#include <gmock/gmock.h>

#include <cmath>

#include "session/session.h"
#include "session/spec.h"
#include "tests/emtbd.h"
#include "tests/plant_bench.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(DeviceClockText, SaysFastOrSlowAndHowSurely) {
  const DeviceClock known{.signals = {Signal::e_a, Signal::omega},
                          .estimate = {.fast = -39.84e-6, .std_error = 0.52e-6, .ahead = -2.4e-3, .over = 60.2}};
  EXPECT_EQ(describe(known), "e_a, omega: their clock is slow by 39.8 ppm (+-0.5, over 60 s), 2.4 ms by now");
  EXPECT_EQ(describe({.signals = {Signal::omega}, .estimate = {}}),
            "omega: how their clock runs against ours is not known yet");
}

/// The real daemon on a bench whose card scans by a clock of its own.
class CardWithAClock : public Scratch {
 protected:
  /// @param process a plant in a process of its own, by that name @param jitter [s]
  std::filesystem::path bench(double ppm, const std::string& process = "", double jitter = 5e-4) const {
    std::string text = PlantName().bench();
    text.insert(text.find("    channels:"), "    clock: {ppm: " + std::to_string(ppm) +
                                                ", block: 0.005, jitter: " + std::to_string(jitter) + "}\n");
    const auto from = text.find("  process: "), to = text.find('\n', from) + 1;
    text.replace(from, to - from, process.empty() ? "" : "  process: " + process + "\n");
    return write("bench.yaml", text);
  }
};

TEST_F(CardWithAClock, IsFollowedAndTheSessionTellsHowItRan) {
  for (const double ppm : {-60.0, 45.0}) {
    Process emtbd(emtbd_words(bench(ppm), path(""), {"--pace", "max"}), path("emtbd"));
    const auto daemon = client_of(emtbd, path("s"));
    ASSERT_TRUE(daemon) << emtbd.err();
    const json end = run_to_its_end(*daemon, "name: long\nkind: step\nlevel: 2\nbefore: 1\nhold: 60\nafter: 1\n");
    ASSERT_EQ(end["outcome"], "done") << end;
    const Session session = read_session(end["session"].get<std::string>());
    const auto clock = std::ranges::find(session.events, event_code::clock, &Event::code);
    ASSERT_NE(clock, session.events.end());
    double told = 0;
    ASSERT_EQ(std::sscanf(clock->text.c_str(), "e_a, i_a, omega: their clock is %*s by %lf ppm", &told), 1)
        << clock->text;
    EXPECT_NEAR(told, std::abs(ppm), 4) << clock->text;
    EXPECT_THAT(clock->text, HasSubstr(ppm < 0 ? "slow" : "fast"));
    const Series& omega = session.runs.at(0).at(Signal::omega);
    const auto count = static_cast<double>(omega.t.size() - 1);
    EXPECT_NEAR((omega.t.back() - omega.t.front()) / count, 1e-3 * (1 - ppm * 1e-6), 1e-8)
        << "samples bear our time, not the card's: 1e-9 s apart is 1 ppm";
  }
}

TEST_F(CardWithAClock, StatusShowsItLive) {
  Process emtbd(emtbd_words(bench(90, "", 2e-5), path("")), path("emtbd"));
  const auto daemon = client_of(emtbd, path("s"));
  ASSERT_TRUE(daemon) << emtbd.err();
  json clock;
  EXPECT_TRUE(eventually([&] {
    clock = daemon->call("status", {})["clocks"].at(0);
    return clock["over"] > 4 && clock["std_error_ppm"] < 30;
  })) << clock;
  EXPECT_THAT(clock["signals"], ElementsAre("e_a", "i_a", "omega"));
  EXPECT_NEAR(clock["fast_ppm"].get<double>(), 90, 60) << clock;
  EXPECT_TRUE(clock["ahead"].is_number());
}

TEST_F(CardWithAClock, OfAPlantInAProcessOfItsOwnAsWell) {
  const PlantName name;
  const auto file = bench(50, name.text());
  Process plant({EMTB_PLANT, "--config", file.string()}, path("plant"));
  ASSERT_TRUE(eventually([&] { return plant.out().find("lives") != std::string::npos; })) << plant.err();
  Process emtbd(emtbd_words(file, path("")), path("emtbd"));
  const auto daemon = client_of(emtbd, path("s"));
  ASSERT_TRUE(daemon) << emtbd.err();
  json clock;
  EXPECT_TRUE(eventually([&] {
    clock = daemon->call("status", {})["clocks"].at(0);
    return clock["over"] > 3 && clock["std_error_ppm"].is_number();
  })) << clock;
}

}  // namespace
}  // namespace emtb
