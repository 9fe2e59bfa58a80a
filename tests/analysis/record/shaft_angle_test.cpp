#include "analysis/record/shaft_angle.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

constexpr double interval = 2e-3;  // [s]

/// A minute at several speeds of both signs, and what a tachogenerator reads of it.
struct Turning {
  std::vector<double> angle, reading;
};

Turning turning(double ripple, double sigma, double rho, double offset = 0) {
  const std::vector<double> noise = synthetic::coloured(30000, rho, 3);
  Turning run;
  double angle = 0.4;
  for (std::size_t k = 0; k < noise.size(); ++k) {
    const double t = static_cast<double>(k) * interval;
    const double speed = 80 * std::sin(0.21 * t) + 20 * std::sin(1.3 * t);  // [rad/s]
    angle += speed * interval;
    run.angle.push_back(angle);
    run.reading.push_back(speed * (1 + ripple * std::sin(6 * angle + 1)) + offset + sigma * noise[k]);
  }
  return run;
}

std::vector<double> integrated(const std::vector<double>& omega) {
  std::vector<double> angle;
  double sum = 0;
  for (const double w : omega) angle.push_back(sum += w * interval);
  return angle;
}

/// [rad] by how much the one wanders from the other.
double wander(const std::vector<double>& angle, const std::vector<double>& truth) {
  double mean = 0, squares = 0;
  const double n = static_cast<double>(truth.size());
  for (std::size_t k = 0; k < truth.size(); ++k) mean += (angle[k] - truth[k]) / n;
  for (std::size_t k = 0; k < truth.size(); ++k) squares += std::pow(angle[k] - truth[k] - mean, 2) / n;
  return std::sqrt(squares);
}

TEST(ShaftAngle, WandersNoMoreWhereTheTachogeneratorsRippleTellsIt) {
  for (const double offset : {0.0, 0.05}) {
    const Turning run = turning(0.02, 0.3, 0.95, offset);
    std::vector<double> angle = integrated(run.reading);
    EXPECT_GT(wander(angle, run.angle), 0.1);
    tie_to_ripple(angle, run.reading, interval);
    EXPECT_LT(wander(angle, run.angle), 0.03) << "offset " << offset;
  }
}

/// The reading through a lag of the first order.
std::vector<double> lagged(const std::vector<double>& x, double lag) {
  std::vector<double> y;
  double state = x.front();
  for (const double v : x) y.push_back(state += (v - state) * -std::expm1(-interval / lag));
  return y;
}

TEST(ShaftAngle, IsNotLeftBehindByATachogeneratorThatLags) {
  for (const double lag : {0.004, 0.01}) {
    Turning run = turning(0.03, 0, 0);
    run.reading = lagged(run.reading, lag);
    const std::vector<double> noise = synthetic::coloured(run.reading.size(), 0.9, 4);
    for (std::size_t k = 0; k < noise.size(); ++k) run.reading[k] += 0.1 * noise[k];
    std::vector<double> angle = integrated(run.reading);
    EXPECT_GT(wander(angle, run.angle), 0.1);
    tie_to_ripple(angle, run.reading, interval);
    EXPECT_LT(wander(angle, run.angle), 0.07) << "lag " << lag;
  }
}

TEST(ShaftAngle, IsLeftAloneWhereNothingRepeatsWithIt) {
  const Turning run = turning(0, 0.3, 0.95);
  const std::vector<double> before = integrated(run.reading);
  std::vector<double> angle = before;
  tie_to_ripple(angle, run.reading, interval);
  EXPECT_EQ(angle, before);
}

/// A run of a tachogenerator with a ripple, whose speed goes from one value to another within a minute.
/// @param heavy [rad2/s2] of a shaft with a weight off its centre: it runs less evenly the slower it is
emtb::Run rippling(double from, double to, int order, double heavy = 0) {
  const std::vector<double> noise = synthetic::coloured(30000, 0, order);
  Run run;
  run.name = "rippling";
  Series omega;
  double angle = 0.4;
  for (std::size_t k = 0; k < noise.size(); ++k) {
    const double share = static_cast<double>(k) / static_cast<double>(noise.size());
    const double speed = from + share * (to - from);  // [rad/s]
    angle += speed * interval;
    omega.t.push_back(static_cast<double>(k) * interval);
    omega.value.push_back(speed * (1 + (heavy > 0 ? heavy / speed / speed : 0.01) * std::sin(order * angle)) +
                          0.3 * noise[k]);
  }
  run.signals.emplace(Signal::omega, std::move(omega));
  return run;
}

TEST(RippleOrder, OfARunAtOneSpeedIsToldByTheOthers) {
  // At 2 ms and 230 rad/s there are 13.66 readings a turn: what repeats 9 times looks as if it did 4.66 times.
  const std::vector<emtb::Run> both{rippling(230, 230, 9), rippling(60, 200, 9)};
  EXPECT_EQ(ripple_order(both), 9);
  std::vector<double> grid = both[0].at(Signal::omega).t, truth;
  for (const double t : grid) truth.push_back(230 * t);
  EXPECT_LT(wander(measured_angle(both[0], grid, 9.0).angle, truth), 0.02);
  EXPECT_EQ(ripple_order(std::vector<emtb::Run>{rippling(10, 10.5, 0)}), std::nullopt) << "nothing repeats";
}

TEST(RippleOrder, WhatFadesAtSpeedIsNotOfTheTachogenerator) {
  const std::vector<emtb::Run> slow{rippling(20, 40, 1, 30)};
  EXPECT_EQ(ripple_order(slow), 1);
  const std::vector<emtb::Run> both{rippling(20, 40, 1, 30), rippling(60, 200, 1, 30)};
  EXPECT_EQ(ripple_order(both), std::nullopt) << "only the slow run could be tied to it";
  const std::vector<emtb::Run> ripple{rippling(20, 40, 1), rippling(60, 200, 1)};
  EXPECT_EQ(ripple_order(ripple), 1) << "a ripple of the tachogenerator grows";
}

}  // namespace
}  // namespace emtb
