#include "analysis/check/dead_reference.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <vector>

#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

using OverTime = std::function<double(double)>;

/// Ten seconds of a bench whose reference says nothing.
emtb::Run run_of(const std::map<Signal, OverTime>& signals) {
  emtb::Run run;
  run.name = "one";
  synthetic::Noise noise(5);
  for (int k = 0; k < 1000; ++k) {
    const double t = 0.01 * k;
    const auto add = [&](Signal signal, double value) {
      run.signals[signal].t.push_back(t);
      run.signals[signal].value.push_back(value);
    };
    add(Signal::u_ref, 0);
    for (const auto& [signal, value] : signals) add(signal, value(t) + noise(0.01));
  }
  return run;
}

DataFindings look_at_reference(const emtb::Run& run) { return dead_reference(std::span(&run, 1)); }

double step(double t) { return t > 2 && t < 7 ? 1 : 0; }
double nothing(double) { return 0; }
double coasting(double t) { return t < 1 ? 1 : std::exp(-(t - 1) / 2); }

const OverTime e_a = [](double t) { return 50 * step(t); };
const OverTime i_a = [](double t) { return 0.3 * step(t); };
const OverTime omega = [](double t) { return 80 * step(t); };

TEST(DeadReference, IsRemarkedBesideAMotorThatIsDriven) {
  for (const auto& signals : std::vector<std::map<Signal, OverTime>>{
           {{Signal::e_a, e_a}, {Signal::i_a, i_a}, {Signal::omega, omega}},
           {{Signal::e_a, e_a}, {Signal::omega, omega}},
           {{Signal::i_a, i_a}, {Signal::omega, omega}},
           {{Signal::e_a, [](double t) { return -e_a(t); }}, {Signal::i_a, [](double t) { return -i_a(t); }}}}) {
    const DataFindings found = look_at_reference(run_of(signals));
    ASSERT_THAT(found, SizeIs(1)) << signals.size();
    EXPECT_EQ(found[0].what, Flaw::rest);
    EXPECT_EQ(found[0].signal, Signal::u_ref);
    EXPECT_FALSE(found[0].stops);
    EXPECT_THAT(found[0].text,
                HasSubstr("u_ref is exactly 0 in all runs though something drives the motor: is it wired?"));
  }
}

TEST(DeadReference, IsRightWhereNothingDrivesTheMotor) {
  const OverTime emf = [](double t) { return 50 * coasting(t); }, slower = [](double t) { return 80 * coasting(t); };
  EXPECT_THAT(look_at_reference(run_of({{Signal::e_a, emf}, {Signal::i_a, nothing}, {Signal::omega, slower}})),
              IsEmpty())
      << "a coast-down";
  EXPECT_THAT(look_at_reference(run_of({{Signal::e_a, emf}, {Signal::omega, slower}})), IsEmpty());
  const OverTime brakes = [](double t) { return -coasting(t); };
  EXPECT_THAT(look_at_reference(run_of({{Signal::e_a, emf}, {Signal::i_a, brakes}, {Signal::omega, slower}})),
              IsEmpty())
      << "it brakes into a resistor";
  EXPECT_THAT(look_at_reference(run_of({{Signal::e_a, e_a}, {Signal::i_a, nothing}, {Signal::omega, omega}})),
              IsEmpty())
      << "another motor turns it";
  const OverTime loaded = [](double t) { return -i_a(t); };
  EXPECT_THAT(look_at_reference(run_of({{Signal::e_a, e_a}, {Signal::i_a, loaded}, {Signal::omega, omega}})), IsEmpty())
      << "and it feeds a lamp";
  emtb::Run open = run_of({{Signal::e_a, e_a}, {Signal::omega, omega}});
  open.signals[Signal::armature_open] = open.at(Signal::u_ref);
  for (double& v : open.signals[Signal::armature_open].value.edit()) v = 1;
  EXPECT_THAT(look_at_reference(open), IsEmpty());
  EXPECT_THAT(look_at_reference(run_of({{Signal::e_a, nothing}, {Signal::i_a, nothing}, {Signal::omega, nothing}})),
              IsEmpty());
}

TEST(DeadReference, OneOfSeveralRunsThatKnowsTheReferenceIsEnough) {
  const emtb::Run dead = run_of({{Signal::e_a, e_a}, {Signal::i_a, i_a}, {Signal::omega, omega}});
  emtb::Run live = dead;
  for (std::size_t k = 0; k < live.at(Signal::u_ref).t.size(); ++k) {
    live.signals[Signal::u_ref].value.edit()[k] = step(live.at(Signal::u_ref).t[k]);
  }
  EXPECT_THAT(look_at_reference(live), IsEmpty());
  EXPECT_THAT(dead_reference(std::vector{dead, live}), IsEmpty());
  EXPECT_THAT(dead_reference(std::vector{dead, dead}), SizeIs(1));
}

}  // namespace
}  // namespace emtb
