#include "analysis/record/count_errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "analysis/fit/residuals.h"
#include "analysis/record/dataset.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using synthetic::series;
using synthetic::servo_model;

constexpr double q = 2 * std::numbers::pi / 1320;  // [rad] of the encoder

/// An encoder's whole counts at times that may jitter.
Series counts(double interval, double seconds, const std::function<double(double)>& angle, double jitter = 0) {
  Series theta;
  std::mt19937 lot(7);
  std::normal_distribution<double> off(0, jitter > 0 ? jitter : 1);
  for (double t = 0; t < seconds; t += interval) {
    theta.t.push_back(t + (jitter > 0 ? off(lot) : 0));
    theta.value.push_back(q * std::floor(angle(theta.t.back()) / q));
  }
  theta.lsb = q;
  return theta;
}

struct Misses {
  double seen = 0;      ///< rms of speed read less true speed
  double foretold = 0;  ///< rms of what the counts are said to leave
};

/// Of many encoders that begin anywhere in a step.
Misses misses(double interval, const std::function<double(double)>& speed, const std::function<double(double)>& angle,
              double jitter = 0) {
  Misses m;
  double n = 0;
  for (int turn = 0; turn < 40; ++turn) {
    const double from = 0.37 * q * turn;
    const Series theta = counts(
        interval, 2, [&](double t) { return from + angle(t); }, jitter);
    const Observation o = speed_of_encoder(theta, theta.t);
    for (std::size_t i = 0; i < o.size(); ++i) {
      const double middle = 0.5 * (o.begin[i] + o.end[i]);
      m.seen += std::pow(o.value[i] - speed(middle), 2);
      m.foretold += o.counted[i];
      n += 1;
    }
  }
  return {std::sqrt(m.seen / n), std::sqrt(m.foretold / n)};
}

Misses misses_at(double speed, double interval = 5e-3, double jitter = 0) {
  return misses(
      interval, [=](double) { return speed; }, [=](double t) { return speed * t; }, jitter);
}

TEST(CountErrors, AreForetoldAtAnySpeed) {
  for (const double speed : {3.1, 7.7, 12.3, 20.0, 33.3, -14.2}) {
    const Misses m = misses_at(speed);
    EXPECT_NEAR(m.foretold / m.seen, 1, 0.15) << speed << " rad/s: " << m.seen << " seen";
  }
}

TEST(CountErrors, AreForetoldWhileTheShaftSpeedsUp) {
  const Misses m = misses(
      5e-3, [](double t) { return 5 + 10 * t; }, [](double t) { return 5 * t + 5 * t * t; });
  EXPECT_NEAR(m.foretold / m.seen, 1, 0.05);
  EXPECT_NEAR(m.seen, q / std::sqrt(12.0) / 5e-3 / std::sqrt(10.0), 0.01) << "as of independent counts";
}

TEST(CountErrors, AreForetoldWhereTheSamplingJitters) {
  const Misses m = misses_at(12.3, 5e-3, 3e-4);
  EXPECT_NEAR(m.foretold / m.seen, 1, 0.1);
}

TEST(CountErrors, AreSmallAtAWholeNumberOfCountsASample) {
  const Misses whole = misses_at(4 * q / 5e-3), between = misses_at(4.15 * q / 5e-3);
  EXPECT_LT(whole.seen, 0.2 * between.seen);
  EXPECT_LT(whole.foretold, 0.5 * between.foretold);
}

TEST(CountErrors, OfACrawlAreNoSmallerThanWhatNoCountTells) {
  const Misses m = misses_at(0.1);  // a count in 48 ms
  EXPECT_GE(m.foretold, m.seen);
  EXPECT_LT(m.foretold, 3 * m.seen);
}

TEST(CountErrors, AtRestAllowASpeedBelowOneCountAWindow) {
  const Misses m = misses_at(0);
  EXPECT_EQ(m.seen, 0);
  EXPECT_NEAR(m.foretold, q / (2 * 0.02), 0.05 * m.foretold);
}

TEST(CountErrors, OfNeighboursHangTogetherAsTheLinesOverlap) {
  const auto angle = [](double t) { return 5 * t + 5 * t * t; };
  double product = 0, squares = 0, foretold = 0;
  for (int turn = 0; turn < 40; ++turn) {
    const Series theta = counts(5e-3, 2, [&](double t) { return 0.37 * q * turn + angle(t); });
    const Observation o = speed_of_encoder(theta, theta.t);
    foretold += o.counted_correlation / 40;
    double before = 0;
    for (std::size_t i = 0; i < o.size(); ++i) {
      const double off = o.value[i] - 5 - 10 * 0.5 * (o.begin[i] + o.end[i]);
      product += i > 0 ? off * before : 0;
      squares += off * off;
      before = off;
    }
  }
  EXPECT_NEAR(foretold, product / squares, 0.05);
}

TEST(CountErrors, OfADifferenceAreASixthOfAStepSquaredOnTheAverage) {
  double seen = 0, foretold = 0, n = 0;
  for (int turn = 0; turn < 40; ++turn) {
    const auto angle = [&](double t) { return 0.37 * q * turn + 5 * t + 5 * t * t; };
    const Series theta = counts(5e-3, 2, angle);
    const Observation o = angle_increments(theta, theta.t);
    for (std::size_t i = 0; i < o.size(); ++i) {
      seen += std::pow(o.value[i] - angle(o.end[i]) + angle(o.begin[i]), 2);
      foretold += o.counted[i];
      n += 1;
    }
  }
  EXPECT_NEAR(foretold / seen, 1, 0.05);
  EXPECT_NEAR(seen / n, q * q / 6, 0.1 * q * q / 6);
}

TEST(SpeedOfEncoder, IsExactForAConstantAcceleration) {
  Series theta = series(1e-3, 2, [](double t) { return 3 + 20 * t + 0.5 * 70 * t * t; });
  const Observation o = speed_of_encoder(theta, theta.t);
  ASSERT_GT(o.size(), 90U);
  for (std::size_t i = 0; i < o.size(); ++i) {
    EXPECT_NEAR(o.value[i], 20 + 70 * 0.5 * (o.begin[i] + o.end[i]), 1e-8);
    EXPECT_NEAR(o.predicted(i, [&](std::size_t k) { return theta.value[k]; }), o.value[i], 1e-8);
  }
  EXPECT_NEAR(o.end[1] - o.end[0], 0.01, 1e-12) << "closer ones would share their noise";
}

TEST(SpeedOfEncoder, IsPredictedFromTheSameSumOfAnglesAlsoBetweenTheTimesOfTheInput) {
  std::vector<double> grid;
  for (int k = 0; k <= 400; ++k) grid.push_back(2.5e-3 * k);
  Series theta;
  for (int k = 1; k < 190; ++k) theta.t.push_back(5.2e-3 * k + 3e-4 * (k % 3));
  for (const double t : theta.t) theta.value.push_back(20 * t);
  const Observation o = speed_of_encoder(theta, grid);
  ASSERT_GT(o.size(), 50U);
  for (std::size_t i = 0; i < o.size(); ++i) {
    EXPECT_NEAR(o.predicted(i, [&](std::size_t k) { return 20 * grid[k]; }), 20, 1e-9);
  }
}

TEST(NoiseFloor, OfAnEncodersSpeedIsWhatItsCountsLeaveAndNotItsScatterAtRest) {
  emtb::Run run;
  run.name = "counts";
  const auto speed = [](double t) { return t < 4 ? 0.0 : 14.2; };
  run.signals[Signal::u_ref] = series(5e-3, 8, speed);
  run.signals[Signal::theta] = counts(5e-3, 8, [](double t) { return t < 4 ? 0.0 : 14.2 * (t - 4); });
  const Dataset data = prepare(std::span(&run, 1), {}, servo_model());
  const NoiseFloor& floor = data.noise.at(Signal::omega);
  EXPECT_EQ(floor.from, FloorSource::counts);
  EXPECT_GT(floor.sigma, 0.05);
  EXPECT_LT(floor.sigma, 0.15);
}

}  // namespace
}  // namespace emtb
