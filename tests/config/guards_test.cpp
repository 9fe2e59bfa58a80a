#include "config/guards.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/config/complains.h"

namespace emtb {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

/// A bench with these limits and this rest of its reference's line.
BenchConfig limited(const std::string& limits, const std::string& reference = "min: 0, max: 6, safe: 0") {
  return parse_bench("name: b\nreference: {device: card, " + reference + "}\nlimits:\n  " + limits +
                         "\ndevices: {card: {driver: fake}}\n",
                     "b.yaml");
}

Channel channel(Signal signal, double low, double high) {
  return {.signal = signal, .period = 1e-3, .window = 0, .lsb = 0.1, .source = "card 0", .low = low, .high = high};
}

std::string refusal(const BenchConfig& of, const std::vector<Channel>& channels) {
  return complaint([&] { refuse_what_guards_nothing(of, channels); });
}

TEST(Guards, ALimitOfASignalThatNothingMeasuresIsRefusedWithItsLine) {
  EXPECT_EQ(refusal(limited("omega: 190"), {channel(Signal::e_a, -10, 10)}),
            "b.yaml:4: limits.omega guards nothing: no device of this bench measures omega. Is one of its "
            "devices not there? Else add a channel for it, or remove `omega: 190`");
}

TEST(Guards, ALimitBeyondWhatItsChannelReadsIsRefusedWithOneThatItSees) {
  EXPECT_EQ(refusal(limited("omega: 190"), {channel(Signal::omega, -100, 100)}),
            "b.yaml:4: limits.omega guards nothing: card 0, which reads -100 to 100 rad/s, never reads beyond 190 "
            "rad/s. Write omega: 95 or less, or let it read further");
  EXPECT_THAT(refusal(limited("omega: 190"), {channel(Signal::omega, -200, 190)}), HasSubstr("guards nothing"));
}

TEST(Guards, BothDirectionsCountWhereTheDriverHasBoth) {
  const auto one_sided = {channel(Signal::omega, 0, 200)};
  EXPECT_NO_THROW(refuse_what_guards_nothing(limited("omega: 190"), one_sided));
  EXPECT_THAT(refusal(limited("omega: 190", "min: -6, max: 6, safe: 0"), one_sided), HasSubstr("never reads beyond"));
}

TEST(Guards, AChannelThatDoesNotSayHowFarItReadsIsAskedTo) {
  Channel unknown{.signal = Signal::i_a, .period = 0.2, .window = 0.2, .lsb = 0, .source = "meter (Modbus)"};
  EXPECT_THAT(refusal(limited("i_a: 2"), {unknown}),
              HasSubstr("limits.i_a guards nothing that is known: meter (Modbus) does not say how far it reads. Write "
                        "range: ..."));
  unknown.endless = true;
  EXPECT_NO_THROW(refuse_what_guards_nothing(limited("i_a: 2"), {&unknown, 1}));
}

TEST(Guards, SayWhatGuardsWhatAndHowFast) {
  Channel meter = channel(Signal::i_a, -20, 20);
  meter.period = meter.window = 0.4;
  const auto guards = guards_of(limited("i_a: 2\n  time: 60"), {&meter, 1});
  ASSERT_THAT(guards, SizeIs(1));
  EXPECT_EQ(guards[0].text, "limits.i_a, 2 A: card 0, which reads -20 to 20 A, says so within 0.801 s");
  EXPECT_THAT(guards[0].wrong, IsEmpty());
}

TEST(Guards, SafeIsTheAllowedValueNearestZeroOrTheFileSaysWhyNot) {
  const auto of = [](const std::string& reference) { return limited("time: 60", reference); };
  EXPECT_NO_THROW(refuse_what_guards_nothing(of("min: 1, max: 6, safe: 1"), {}));
  EXPECT_EQ(refusal(of("min: 0, max: 6, safe: 2"), {}),
            "b.yaml:2: reference.safe is 2 V, but of the allowed values 0 V is the nearest to 0. Write safe: 0, or say "
            "why: safe_because: \"...\"");
  const BenchConfig told = of("min: 0, max: 6, safe: 2, safe_because: the driver brakes at 2 V");
  EXPECT_NO_THROW(refuse_what_guards_nothing(told, {}));
  EXPECT_EQ(why_not_zero(told), "the driver brakes at 2 V");
  EXPECT_EQ(why_not_zero(of("min: 0, max: 6, safe: 0, safe_because: no")), "");
}

}  // namespace
}  // namespace emtb
