#include "analysis/record/thinned.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "analysis/record/dataset.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

/// A machine whose speed and torque go up and down within seconds.
emtb::Run swinging(double step) {
  emtb::Run run;
  run.name = "swinging";
  synthetic::Noise noise(5);
  const auto read = [&](Signal signal, double mean, double swing, double by) {
    run.signals[signal] = synthetic::series(step, 10, [&](double t) { return mean + swing * std::sin(t) + noise(by); });
  };
  read(Signal::u_ref, 2, 0, 0);
  read(Signal::e_a, 8, 1, 0.01);
  read(Signal::i_a, 1, 0, 0.01);
  read(Signal::omega, 180, 20, 0.1);
  read(Signal::torque, 0.02, 0.005, 1e-4);
  return run;
}

Record recorded(double step) {
  Model model = synthetic::servo_model();
  return prepare(std::vector{swinging(step)}, {}, model).train.front();
}

TEST(Thinned, LeavesRowsAsFarApartAsTheShaftAllowsAndTheirReadings) {
  const Record whole = recorded(1e-4), few = thinned(whole);
  const std::vector<double>& t = few.excitation.t;
  ASSERT_LT(few.length(), whole.length() / 10);
  EXPECT_EQ(t.front(), whole.excitation.t.front());
  EXPECT_EQ(t.back(), whole.excitation.t.back());
  for (std::size_t k = 1; k < t.size(); ++k) ASSERT_LE(t[k] - t[k - 1], few.excitation.longest_step * (1 + 1e-9)) << k;
  const Observation *torque = few.find(Signal::torque), *before = whole.find(Signal::torque);
  ASSERT_NE(torque, nullptr);
  ASSERT_EQ(torque->size() + 1, few.length());
  double of_few = 0, of_all = 0;
  for (std::size_t i = 0; i < torque->size(); ++i) {
    const auto from = static_cast<std::size_t>(std::lround(t[torque->first[i]] / 1e-4)),
               to = static_cast<std::size_t>(std::lround(t[torque->last[i]] / 1e-4));
    double mean = 0;
    const std::size_t begin = i == 0 ? from : from + 1;
    for (std::size_t k = begin; k <= to; ++k) mean += before->value[k] / static_cast<double>(to + 1 - begin);
    ASSERT_NEAR(torque->value[i], mean, 1e-12) << i;
    ASSERT_EQ(few.excitation.omega[i + 1], whole.excitation.omega[to]) << i;
    of_few += std::pow(torque->sigma[i], -2);
  }
  for (std::size_t k = 0; k < before->size(); ++k) of_all += std::pow(before->sigma[k], -2);
  EXPECT_GT(of_few, 0.4 * of_all) << "of what they tell";
  EXPECT_LT(of_few, 1.01 * of_all);
}

TEST(Thinned, IsARecordOfFewRowsItself) {
  const Record whole = recorded(4e-3);
  EXPECT_EQ(thinned(whole).length(), whole.length());
}

TEST(SetSteps, OfASlowMotorAreLongInLongRows) {
  Model slow = synthetic::servo_model();
  slow.base[base::J].value *= 100;
  Excitation x;
  set_steps(x, slow);
  EXPECT_EQ(x.longest_step, 5e-2);
}

}  // namespace
}  // namespace emtb
