#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "analysis/diagnose/diagnose.h"
#include "config/formula_effect.h"
#include "hal/error.h"
#include "tests/blind/recording.h"

namespace emtb {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

AddedTerm formula(const std::string& id, const std::string& yaml) {
  return read_formula(YamlMap::parse(id + ": " + yaml, "mine.yaml"), id);
}

Diagnosis diagnose_offering(blind::Bench bench, std::vector<AddedTerm> offered) {
  bench.model.offered = std::move(offered);
  return diagnose(record(bench, bench.train, 1), record(bench, bench.held_out, 101), bench.model);
}

std::vector<std::string> ids_of(const Diagnosis& d) {
  std::vector<std::string> ids;
  for (const MissingEffect& m : d.missing) ids.emplace_back(d.about(m.effect).id);
  return ids;
}

/// A bump of friction at one speed: the library has nothing like it.
blind::Bench bench_with_a_bump() {
  blind::Bench bench = blind::fast_bench();
  bench.plant.hidden_torque = [](double omega, double, double) {
    return std::copysign(0.01 * std::exp(-std::pow((std::abs(omega) - 250) / 40, 2)), omega);
  };
  return bench;
}

TEST(FormulaOnOffer, NamesWhatWasUnknownAndFindsItsShape) {
  const Diagnosis d = diagnose_offering(
      bench_with_a_bump(),
      {formula("bump",
               "{torque: \"-T*sign(omega)*exp(-((abs(omega)-at)/40)^2)\", parameters: {at: {value: 150, min: 50, max: "
               "600, unit: rad/s}, T: {value: 0, min: 0, max: 1, unit: N m}}}")});
  EXPECT_EQ(d.verdict, Verdict::found) << d.final_held_out;
  EXPECT_THAT(ids_of(d), ElementsAre("bump"));
  ASSERT_EQ(d.missing.size(), 1U);
  EXPECT_NEAR(d.missing[0].parameters[0].value, 0.01, 3e-4) << "T, the amplitude, stands first";
  EXPECT_NEAR(d.missing[0].parameters[1].value, 250, 2);
  EXPECT_LE(d.final_held_out, 1.1);
}

TEST(FormulaOnOffer, IsNotNamedWhereItExplainsNothing) {
  const Diagnosis d = diagnose_offering(
      blind::fast_bench(), {formula("late", "{torque: \"-a*t\", parameters: {a: {value: 0, min: 0, max: 1}}}"),
                            formula("there", "{torque: \"-1.0e-7*omega\"}")});
  EXPECT_EQ(d.verdict, Verdict::nothing_missing);
  EXPECT_TRUE(d.missing.empty());
}

TEST(FormulaOnOffer, IsTiedWithTheEffectOfTheLibraryThatItRepeats) {
  blind::Bench bench = blind::slow_bench();
  bench.plant.motor.windage = 3e-6;  // [N m s2/rad2]
  const Diagnosis d = diagnose_offering(
      bench, {formula("twin", "{torque: \"-c2*omega*abs(omega)\", parameters: {c2: {value: 0, min: 0, max: 1e-3}}}")});
  EXPECT_EQ(d.verdict, Verdict::tied);
  ASSERT_EQ(d.missing.size(), 1U);
  std::vector<std::string> both = ids_of(d);
  for (const std::size_t rival : d.missing[0].tied_with) both.emplace_back(d.about(rival).id);
  EXPECT_THAT(both, AllOf(Contains("twin"), Contains("windage")));
}

TEST(FormulaOnOffer, WithoutAParameterIsThereOrNot) {
  blind::Bench bench = blind::slow_bench();
  bench.plant.hidden_torque = [](double omega, double, double) { return 3e-8 * omega * omega * omega; };
  const Diagnosis d = diagnose_offering(bench, {formula("known", "{torque: \"-3.0e-8*omega^3\"}")});
  EXPECT_THAT(ids_of(d), ElementsAre("known"));
  EXPECT_LE(d.final_held_out, 1.1);
}

TEST(FormulaOnOffer, IsRefusedByNameWhereItIsNotFinite) {
  try {
    diagnose_offering(blind::fast_bench(),
                      {formula("root",
                               "{torque: \"-k*sqrt(100 - abs(omega))*omega\", parameters: {k: {value: 0, min: "
                               "0, max: 1}}}")});
    FAIL() << "the bench turns faster than 100 rad/s";
  } catch (const ModelError& e) {
    EXPECT_THAT(e.what(), AllOf(HasSubstr("root"), HasSubstr("not finite")));
  }
}

}  // namespace
}  // namespace emtb
