#include "analysis/check/scale.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "analysis/check/check.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

/// A motor under steps of the voltage, and a load.
/// @param load [N m] of the speed and the row
/// @param lag [s] of the gauge; the tachogenerator's is half of it
template <class Load>
std::vector<emtb::Run> loaded(const Load& load, double lag) {
  constexpr double R_a = 2.2, K = 0.4, B = 5e-4, J = 1.07e-2, dt = 1e-3;
  synthetic::Noise noise(3);
  emtb::Run run;
  run.name = "loaded";
  double omega = 0, tacho = 0, gauge = 0;
  for (int k = 0; k < 12000; ++k) {
    const double e = std::array{0.0, 29.0, 60.0, 0.0, 45.0, 15.0}.at(static_cast<std::size_t>(k / 2000));
    const double i = (e - K * omega) / R_a, torque = load(omega, k);
    omega += dt * (K * i - B * omega - torque) / J;
    tacho += lag > 0 ? dt * (omega - tacho) / (lag / 2) : omega - tacho;
    gauge += lag > 0 ? dt * (torque - gauge) / lag : torque - gauge;
    const auto read = [&](Signal signal, double value, double by) {
      synthetic::add_reading(run, signal, k * dt, value + noise(by));
    };
    read(Signal::e_a, e, 0.01);
    read(Signal::i_a, i, 5e-3);
    read(Signal::omega, tacho, 0.05);
    read(Signal::torque, gauge, 5e-3);
  }
  return {run};
}

MATCHER(IsAScale, "") { return arg.what == Flaw::scale && arg.stops; }

TEST(WrongScales, IsNoneOfInstrumentsThatLagWhereTheTorqueGoesWithTheSpeed) {
  const auto generator = [](double omega, int) { return 1.4e-3 * omega; };
  for (const double lag : {0.08, 0.15, 0.3})
    EXPECT_THAT(check(loaded(generator, lag), {}, nullptr), testing::Not(testing::Contains(IsAScale()))) << lag;
}

TEST(WrongScales, IsThatOfASpeedInDegrees) {
  constexpr double degrees = 57.29577951;
  auto runs = loaded([](double, int k) { return 0.3 * (k / 1300 % 3); }, 0);
  for (double& v : runs[0].signals.at(Signal::omega).value.edit()) v *= degrees;
  EXPECT_THAT(check(runs, {}, nullptr), testing::Contains(IsAScale()));
}

}  // namespace
}  // namespace emtb
