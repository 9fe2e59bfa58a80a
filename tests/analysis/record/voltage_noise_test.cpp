#include "analysis/record/voltage_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "analysis/record/record.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using synthetic::servo_model;

constexpr double R_a = 1.2, per_row = 0.01;
constexpr int rows = 600;

Model driven_by_voltage() {
  Model m = servo_model();
  m.input = Signal::e_a;
  return m;
}

/// A voltage in steps, the current that its exact value drives through a motor that is held fast, and what is read.
/// @param real, noise [V] by which the voltage and its reading hop
Run held_fast(double real, double noise, const std::function<double(int)>& set) {
  std::mt19937 random(1);
  std::normal_distribution<double> draw;
  Series e_a, i_a, omega;
  for (int k = 0; k < rows; ++k) {
    const double e = set(k) + real * draw(random);
    for (Series* s : {&e_a, &i_a, &omega}) s->t.push_back(k * per_row);
    e_a.value.push_back(e + noise * draw(random));
    i_a.value.push_back(e / R_a + 0.02 * draw(random));
    omega.value.push_back(0.1 * draw(random));
  }
  return {.name = "held fast", .signals = {{Signal::e_a, e_a}, {Signal::i_a, i_a}, {Signal::omega, omega}}};
}

double steps(int k) { return std::array{0.0, 3.0, -2.0, 5.0, 1.0, -4.0}.at(static_cast<std::size_t>(k / 50 % 6)); }
double swings(int k) { return 6 * std::sin(0.01 * k); }

bool hops_alone(const emtb::Run& run) { return voltage_hops_alone(std::span(&run, 1), driven_by_voltage()); }

TEST(VoltageNoise, IsThatOfTheInstrumentWhereTheCurrentDoesNotFollow) {
  EXPECT_TRUE(hops_alone(held_fast(0, 0.1, steps)));
  EXPECT_TRUE(hops_alone(held_fast(0, 0.1, swings))) << "without edges";
}

TEST(VoltageNoise, IsTheMotorsWhereTheCurrentFollows) {
  EXPECT_FALSE(hops_alone(held_fast(0.1, 0, steps))) << "a controller passes on the noise of what it reads";
  EXPECT_FALSE(hops_alone(held_fast(0.1, 0, swings)));
  EXPECT_FALSE(hops_alone(held_fast(0.1, 0.05, steps))) << "most of it";
}

TEST(VoltageNoise, IsNoneOfAVoltageThatWasSet) { EXPECT_FALSE(hops_alone(held_fast(0, 0, steps))); }

TEST(VoltageNoise, IsNotToldWithoutACurrent) {
  emtb::Run run = held_fast(0, 0.1, steps);
  run.signals.erase(Signal::i_a);
  EXPECT_FALSE(hops_alone(run));
}

TEST(VoltageNoise, IsAveragedAwayButNotAcrossEdges) {
  const double sigma = 0.1;
  const emtb::Run run = held_fast(0, sigma, steps);
  const ObservedRun quiet = observe_run(run, driven_by_voltage(), Chaining::staged, {.voltage_hops = true});
  double squares = 0, worst = 0;
  for (int k = 0; k < rows; ++k) {
    const double off = quiet.excitation.e_a[static_cast<std::size_t>(k)] - steps(k);
    squares += off * off;
    worst = std::max(worst, std::abs(off));
  }
  EXPECT_LT(std::sqrt(squares / rows), 0.5 * sigma);
  EXPECT_LT(worst, 4 * sigma);
  ASSERT_EQ(quiet.voltage_noise.sigma.size(), static_cast<std::size_t>(rows));
  EXPECT_NEAR(quiet.voltage_noise.sigma[50], sigma, 0.3 * sigma) << "beside an edge";
  EXPECT_LT(quiet.voltage_noise.sigma[75], 0.3 * sigma) << "amid a stretch";
}

}  // namespace
}  // namespace emtb
