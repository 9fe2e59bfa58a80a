#include "report/words.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "model/catalogue.h"
#include "report/verdict.h"

namespace emtb {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(SourceInWords, ExplainsEverySourceOfANoiseFloor) {
  for (const FloorSource source :
       {FloorSource::declared, FloorSource::settled, FloorSource::repeats, FloorSource::regression,
        FloorSource::differences, FloorSource::resolution, FloorSource::assumed}) {
    NoiseFloor floor;
    floor.from = source;
    const std::string words = source_in_words(floor);
    EXPECT_NE(words, name_of(source)) << "a name of the program's, not an explanation";
    EXPECT_GE(words.size(), 20U) << words;
  }
}

TEST(SourceInWords, SaysThatAFloorFromDifferencesIsALowerBound) {
  NoiseFloor floor;
  floor.from = FloorSource::differences;
  floor.lower_bound = true;
  EXPECT_THAT(source_in_words(floor), HasSubstr("lower bound"));
}

TEST(SourceInWords, SaysOfASlowMeterThatItWasHeldAgainstTheFastSignals) {
  NoiseFloor floor;
  floor.from = FloorSource::regression;
  EXPECT_THAT(source_in_words(floor), HasSubstr("fast signals"));
}

TEST(VerdictInWords, SaysOfASearchThatWasCutHowToGoOn) {
  Diagnosis d;
  d.verdict = Verdict::nothing_missing;
  EXPECT_THAT(verdict_in_words(d), Not(HasSubstr("--effort")));
  d.cut = true;
  EXPECT_THAT(verdict_in_words(d), HasSubstr("--effort 10"));
  EXPECT_THAT(verdict_text(d), HasSubstr("--effort 10"));
}

TEST(VerdictInWords, SaysWhatTheModelWouldBeWithATiedEffect) {
  Diagnosis d;
  d.verdict = Verdict::tied;
  for (const auto& known : base_parameters) {
    Parameter p;
    p.symbol = known.symbol;
    d.final.base.push_back(p);
  }
  d.final.at(base::R_a).unit = "ohm";
  const std::size_t lag = effect_index("driver_lag"), coil = effect_index("armature_inductance");
  d.missing.push_back({lag, {coil}, {}, {{coil, "R_a", 9.6921}}});
  EXPECT_THAT(verdict_text(d), HasSubstr("With it R_a = 9.692 ohm."));
  EXPECT_THAT(verdict_in_words(d), HasSubstr("With armature inductance, R_a = 9.692 ohm."));
  d.missing[0].otherwise.clear();
  EXPECT_THAT(verdict_text(d), Not(HasSubstr("With it")));
}

}  // namespace
}  // namespace emtb
