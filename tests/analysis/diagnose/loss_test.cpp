#include "analysis/diagnose/loss.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace emtb {
namespace {

/// One record of one signal, a reading a millisecond, with the residuals given.
class Losses : public testing::Test {
 protected:
  static constexpr int n = 20000;

  Losses() {
    Record run;
    Observation o;
    o.signal = Signal::omega;
    for (int k = 0; k < n; ++k) {
      run.excitation.t.push_back(1e-3 * k);
      o.first.push_back(static_cast<std::uint32_t>(k));
      o.last.push_back(static_cast<std::uint32_t>(k));
      o.value.push_back(0);
      o.sigma.push_back(1);
    }
    run.observations.push_back(o);
    runs_.push_back(run);
    noise_[Signal::omega] = {.sigma = 1, .from = FloorSource::declared, .lower_bound = false, .autocorrelation = 0};
  }

  /// Noise of sigma 1 that is the same in every model, and a systematic part.
  template <class Systematic>
  Loss loss(const Systematic& systematic) const {
    Residuals r{0, Signal::omega, Eigen::VectorXd(n), {}};
    unsigned state = 1;
    for (int k = 0; k < n; ++k) {
      double noise = -6;
      for (int i = 0; i < 12; ++i)
        noise += static_cast<double>((state = state * 1664525U + 1013904223U) >> 8) / (1 << 24);
      r.value[k] = noise + systematic(1e-3 * k);
    }
    Loss result(noise_);
    result.add(runs_, std::vector{r});
    return result;
  }

  std::vector<Record> runs_;
  Noise noise_;
};

TEST_F(Losses, OfPureNoiseIsOne) {
  const Loss noise = loss([](double) { return 0.0; });
  EXPECT_NEAR(noise.error(), 1, 0.02);
  EXPECT_FALSE(remainder(noise));
}

TEST_F(Losses, AreBeyondTheLawsWhereNothingIsLeft) {
  const auto wave = [](double floors) { return [floors](double t) { return floors * std::sin(t); }; };
  const Loss as_given = loss(wave(300)), before = loss(wave(4));
  EXPECT_FALSE(beyond_the_laws(as_given, before, loss(wave(2))))
      << "so much the law of what took the rest may be off by";
  EXPECT_TRUE(beyond_the_laws(as_given, before, loss(wave(0.1))));
  EXPECT_TRUE(beyond_the_laws(loss(wave(30)), before, loss(wave(2))));
}

TEST_F(Losses, CountAnEffectThatActsOnlyAtTwoEdgesAsMaterial) {
  const Loss with = loss([](double) { return 0.0; });
  const Loss without = loss([](double t) { return std::fmod(t, 10) < 0.01 ? 30.0 : 0.0; });  // 20 of 20,000 readings
  EXPECT_TRUE(material(without, with));
  EXPECT_FALSE(material(with, without));
  EXPECT_FALSE(tied(with, without));
  EXPECT_TRUE(remainder(without));
}

TEST_F(Losses, OfAFewReadingsInARowShowInTheirPiece) {
  const auto eight = [](double t) { return t > 4.2 && t < 4.2085 ? 15.0 : 0.0; };
  const auto spike = [](double t) { return t > 4.2 && t < 4.2015 ? 60.0 : 0.0; };
  EXPECT_EQ(loss([](double) { return 0.0; }).most_in_a_piece(Signal::omega), 0) << "noise shares nothing";
  EXPECT_EQ(loss(spike).most_in_a_piece(Signal::omega), 0) << "nor does one reading";
  EXPECT_NEAR(loss(eight).most_in_a_piece(Signal::omega), 7 * 15 * 15 / 1000.0, 0.3) << "of a second's readings";
  EXPECT_FALSE(remainder(loss(eight))) << "the mean over all hides them";
}

TEST_F(Losses, OfWhatLeavesAllBoundsAreWorseThanAllOthers) {
  const Loss bad = loss([](double t) { return 30 * std::sin(t); });
  for (const double far : {1e25, 1e70, std::numeric_limits<double>::infinity(), std::nan("")}) {
    const Loss blown_up = loss([&](double t) { return t > 15 ? far : 0.0; });
    EXPECT_TRUE(blown_up.leaves_all_bounds()) << far;
    EXPECT_TRUE(material(blown_up, bad)) << far;
    EXPECT_FALSE(material(bad, blown_up)) << far;
    EXPECT_FALSE(tied(bad, blown_up)) << far;
    EXPECT_TRUE(remainder(blown_up)) << far;
  }
  EXPECT_FALSE(bad.leaves_all_bounds());
}

TEST_F(Losses, DoNotCountWhatIsSignificantButTrivial) {
  const Loss with = loss([](double) { return 0.0; });
  const Loss without = loss([](double) { return 0.1; });  // 14 standard errors of the mean, 1 % of the mean square
  EXPECT_FALSE(material(without, with));
  EXPECT_TRUE(tied(with, without));
}

TEST_F(Losses, DoNotCountASmallPartOfALargeExcess) {
  const Loss before = loss([](double t) { return 5 * std::sin(t); });
  const Loss after = loss([](double t) { return 4.9 * std::sin(t); });  // 4 % less
  EXPECT_FALSE(material(before, after));
}

TEST_F(Losses, CountAShareOfWhatWasThereBeforeAnother) {
  const Loss before = loss([](double t) { return 5 * std::sin(t); });  // 12.5 of the mean square
  const Loss without = loss([](double t) { return 1 * std::sin(t); });
  const Loss with = loss([](double) { return 0.0; });  // 0.5 more: all that was left, 4 % of what was
  EXPECT_TRUE(material(without, with));
  EXPECT_FALSE(takes_share(before, 0.1, without, with));
  EXPECT_TRUE(takes_share(before, 0.03, without, with));
}

TEST_F(Losses, AreAllTakenButForAShareOnlyWhereNoiseLeavesThatToTell) {
  const Loss much = loss([](double t) { return 5 * std::sin(t); });
  const Loss a_tenth = loss([](double t) { return 5 * std::sqrt(0.1) * std::sin(t); });
  const Loss nothing = loss([](double) { return 0.0; });
  EXPECT_TRUE(takes_all_but(0.04, much, nothing));
  EXPECT_FALSE(takes_all_but(0.04, much, a_tenth));
  EXPECT_TRUE(takes_all_but(0.12, much, a_tenth));
  const Loss little = loss([](double t) { return std::sin(t); });
  EXPECT_FALSE(takes_all_but(0.04, little, nothing)) << "a 25th of that is less than noise scatters";
}

TEST_F(Losses, CountWhatIsThereAndNotWhatChangesMoreThanItGains) {
  const auto wave = [](double t) { return std::sin(50 * t); };
  const auto disturbance = [&](double t) { return t >= 3 && t < 6 ? 10 * wave(t) : 0; };
  const Loss disturbed = loss(disturbance);
  const Loss fitted = loss([&](double t) { return disturbance(t) - 2.2 * wave(t); });
  EXPECT_NEAR(Loss::difference(disturbed, fitted).at(Signal::omega).gain, 0.88, 0.1) << "12 % of what is left";
  EXPECT_NEAR(Loss::difference(disturbed, fitted).at(Signal::omega).there, 0.36, 0.05);
  EXPECT_FALSE(material(disturbed, fitted));
  const Loss everywhere = loss([&](double t) { return 0.2 * disturbance(t) + 3 * wave(t); });
  const Loss with = loss([&](double t) { return 0.2 * disturbance(t); });
  EXPECT_NEAR(Loss::difference(everywhere, with).at(Signal::omega).there, 1.2, 0.1);
  EXPECT_TRUE(material(everywhere, with));
  const Loss without = loss([&](double t) { return 5 * wave(t); });
  const Loss too_much = loss([&](double t) { return -2.2 * wave(t); });
  EXPECT_NEAR(Loss::difference(without, too_much).at(Signal::omega).there, 0.39, 0.05);
  EXPECT_TRUE(material(without, too_much)) << "four fifths are gone, though it does half as much again as it should";
}

TEST_F(Losses, ScatterMoreInColouredNoise) {
  const Loss white = loss([](double) { return 0.0; });
  noise_[Signal::omega].autocorrelation = 0.95;
  const Loss coloured = loss([](double) { return 0.0; });
  EXPECT_GT(coloured.noise_error(Signal::omega), 3 * white.noise_error(Signal::omega));
}

}  // namespace
}  // namespace emtb
