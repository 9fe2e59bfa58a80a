#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analysis/live/estimator.h"
#include "analysis/live/rest_readings.h"
#include "tests/analysis/live/live_bench.h"

namespace emtb {
namespace {

using namespace live_bench;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

struct Noticed {
  std::vector<LiveChange> changes;  ///< as they were told
  LiveEstimates end;
};

Noticed watch(const LiveBench& bench, const emtb::Run& run) {
  LiveEstimator estimator(bench.model, bench.channels(), bench.setup.rate);
  Noticed noticed;
  feed(estimator, run, [&](Signal signal, double, double&) {
    if (signal == Signal::u_ref) {
      for (LiveChange& change : estimator.news()) noticed.changes.push_back(std::move(change));
    }
    return true;
  });
  noticed.end = estimator.estimates();
  return noticed;
}

const LiveSuspect* suspected(const LiveChange& change, const std::string& name) {
  const auto found = std::ranges::find(change.suspects, name, &LiveSuspect::name);
  return found == change.suspects.end() ? nullptr : &*found;
}

void expect_noticed(const LiveBench& bench, const MotorChange& change) {
  SCOPED_TRACE(bench.setup.plant.driver.min < 0 ? "servo" : "FH2");
  const Noticed noticed = watch(bench, changed_run(bench, change, 1));
  ASSERT_FALSE(noticed.changes.empty());
  const LiveChange& first = noticed.changes.front();
  EXPECT_GT(first.noticed, change.visible) << describe(first);
  EXPECT_LE(first.noticed, change.visible + 5) << describe(first);
  EXPECT_NEAR(first.since, change.visible, 1.5) << describe(first);
  ASSERT_NE(suspected(first, change.name), nullptr) << describe(first);
  // With the seconds that followed it is known better.
  const LiveChange& last = noticed.end.misfit.changes.front();
  ASSERT_NE(suspected(last, change.name), nullptr) << describe(last);
  EXPECT_NEAR(suspected(last, change.name)->change, change.size, 0.15 * change.size) << describe(last);
}

TEST(LiveMisfit, NoticesAWarmerWindingUnderLoad) {
  const LiveBench bench = loaded(slow_live_bench());
  expect_noticed(bench, hotter(bench, 0.1));
}

TEST(LiveMisfit, NoticesAnAddedInertiaWithTheNextStepOfTheReference) {
  for (const LiveBench& bench : {slow_live_bench(), fast_live_bench()}) expect_noticed(bench, heavier(bench, 0.2));
}

TEST(LiveMisfit, NoticesWhatRubs) {
  expect_noticed(slow_live_bench(), rubbing(0.02));
  expect_noticed(fast_live_bench(), rubbing(0.002));
}

TEST(LiveMisfit, NoticesABrakeLeftOnByTheGauge) { expect_noticed(slow_live_bench(), braked(0.02)); }

TEST(LiveMisfit, AHealthyMotorStaysQuietAtAnySpeedAndLoad) {
  for (LiveBench bench : {slow_live_bench(), fast_live_bench(), loaded(slow_live_bench())}) {
    bench.colour_tacho(0.97);
    const double high = bench.setup.plant.driver.min < 0 ? 4 : 6, low = high == 6 ? 0 : -4;
    const Profile profile = random_steps("random", low, high, 1, 8, 2, 110, 2, 11);
    const Noticed noticed = watch(bench, simulated::record(bench.setup, profile, 1));
    EXPECT_TRUE(noticed.changes.empty()) << describe(noticed.changes.front());
    EXPECT_TRUE(noticed.end.misfit.watching);
    EXPECT_THAT(noticed.end.misfit.points_to, IsEmpty());
    ASSERT_THAT(noticed.end.misfit.where, Not(IsEmpty()));
    int bins_of_speed = 0;
    for (const LiveBin& bin : noticed.end.misfit.where) {
      for (const auto& [signal, times] : bin.normalised) {
        if (signal == Signal::omega && low == 0) {
          ++bins_of_speed;
          EXPECT_LT(times, 2.5) << "at " << bin.from << " to " << bin.to;
        }
      }
    }
    EXPECT_TRUE(bins_of_speed > 0 || low < 0);
  }
}

// The first values of a motor are far off: what was linear about them said of directions in which one way of turning
// tells nothing (a drop at the brushes or an offset of the tacho) what the first step down then contradicted.
TEST(LiveMisfit, TheFirstStepDownContradictsNothingThatTheStepsUpTaught) {
  const LiveBench bench = slow_live_bench();
  const Noticed noticed = watch(bench, simulated::record(bench.setup, bench.staircase, 23));
  EXPECT_TRUE(noticed.changes.empty()) << describe(noticed.changes.front());
  EXPECT_TRUE(noticed.end.misfit.watching);
}

// Against a brake whose torque rises with the speed, a gauge's noise hides the load as the shaft starts.
TEST(LiveMisfit, AMotorThatStartsAgainstABrakeHasNoLargerInertia) {
  const LiveBench bench = loaded(fast_live_bench());
  const Noticed noticed = watch(bench, changed_run(bench, hotter(bench, 0), 45));  // stands until 60 s
  EXPECT_TRUE(noticed.changes.empty()) << describe(noticed.changes.front());
  EXPECT_TRUE(noticed.end.misfit.watching);
}

TEST(LiveMisfit, PointsToTheFrictionThatTheModelLacksAndToWhereItFails) {
  LiveBench bench = slow_live_bench();
  bench.model.exclude(effect_index("coulomb_friction"));
  const Noticed noticed = watch(bench, simulated::record(bench.setup, bench.staircase, 1));
  const auto& points_to = noticed.end.misfit.points_to;
  ASSERT_FALSE(points_to.empty());
  EXPECT_EQ(points_to.front().name, "coulomb_friction.T_c");
  EXPECT_NEAR(points_to.front().change, bench.setup.plant.friction.T_c, 0.3 * bench.setup.plant.friction.T_c);
  double worst = 0;
  for (const LiveBin& bin : noticed.end.misfit.where) {
    if (bin.against == Signal::omega && bin.normalised.contains(Signal::omega)) {
      worst = std::max(worst, bin.normalised.at(Signal::omega));
    }
  }
  EXPECT_GT(worst, 3);
}

TEST(LiveMisfit, SaysWhatCannotBeToldApart) {
  LiveBench bench = slow_live_bench();
  std::erase_if(bench.setup.channels, [](const auto& c) { return c.signal == Signal::torque; });
  const Noticed noticed = watch(bench, changed_run(bench, braked(0.02), 1));
  ASSERT_FALSE(noticed.changes.empty());
  const LiveChange& change = noticed.changes.front();
  EXPECT_NE(suspected(change, "load_torque.T_L"), nullptr) << describe(change);
  EXPECT_NE(suspected(change, "coulomb_friction.T_c"), nullptr) << describe(change);
  EXPECT_THAT(describe(change), HasSubstr("tied with"));
}

// A stronger field would slow the motor as a warmer winding does, but it would draw less current at the same load.
TEST(LiveMisfit, DoesNotNameWhatAnotherSignalContradicts) {
  const LiveBench bench = loaded(slow_live_bench());
  const MotorChange warmer = hotter(bench, 0.1);
  const Noticed noticed = watch(bench, changed_run(bench, warmer, 10));
  ASSERT_FALSE(noticed.changes.empty());
  EXPECT_NE(suspected(noticed.changes.front(), warmer.name), nullptr) << describe(noticed.changes.front());
  EXPECT_EQ(suspected(noticed.changes.front(), "K_b"), nullptr) << describe(noticed.changes.front());
}

TEST(RestReadings, ContradictWhatAnInstrumentWouldHaveAddedThere) {
  RestReadings at_rest(1);
  const NoiseColour colour{.sigma = 0.1, .rho = 0};
  EXPECT_FALSE(at_rest.contradict(0, 32, 1, colour, 5)) << "nothing was read at rest";
  for (int k = 0; k < 20; ++k) at_rest.see(0, 0.1);
  EXPECT_TRUE(at_rest.contradict(0, 32, 1, colour, 5));
  EXPECT_FALSE(at_rest.contradict(0, 0.12, 0.01, colour, 5));
  EXPECT_FALSE(at_rest.contradict(0, 3, 1, colour, 5)) << "it may as well be 0.1";
}

TEST(LiveMisfit, PointsToAnOffsetOfTheTachoThatIsReadAtRestToo) {
  LiveBench bench = slow_live_bench();
  emtb::Run run = simulated::record(bench.setup, bench.staircase, 4);
  for (double& v : run.signals.at(Signal::omega).value.edit()) v += 2;  // [rad/s]
  const Noticed noticed = watch(bench, run);
  EXPECT_NE(std::ranges::find(noticed.end.misfit.points_to, "tacho_offset.omega_0", &LiveSuspect::name),
            noticed.end.misfit.points_to.end());
}

TEST(LiveMisfit, TellsAChangeOnce) {
  const LiveBench bench = slow_live_bench();
  EXPECT_EQ(watch(bench, changed_run(bench, heavier(bench, 0.2), 1)).changes.size(), 1U);
}

TEST(LiveChange, ReadsAsASentence) {
  const LiveChange change{.since = 12.4,
                          .noticed = 14.4,
                          .omega = 78.2,
                          .i_a = 0.11,
                          .suspects = {{"coulomb_friction.T_c", "N m", 0.0202, 0.0021, 9.6},
                                       {"load_torque.T_L", "N m", 0.0202, 0.0021, 9.5}}};
  EXPECT_EQ(describe(change),
            "since 12.4 s the motor needs 0.0202 +- 0.0021 N m more than before: a brake left on, does something rub? "
            "(coulomb_friction.T_c; tied with load_torque.T_L; it shows at 78 rad/s and 0.11 A)");
  EXPECT_THAT(describe(LiveChange{.since = 1, .suspects = {}}), HasSubstr("nothing that is looked for explains it"));
}

}  // namespace
}  // namespace emtb
