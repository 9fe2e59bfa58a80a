#include "drivers/scpi_meter/answer.h"

#include <gmock/gmock.h>

#include <string>

namespace emtb::scpi_meter {
namespace {

using serial_meter::Message;
using serial_meter::Quantity;

std::string found(const Place& place, const std::string& line) { return std::string(place.in(line).value_or("none")); }

Place matching(const std::string& pattern) {
  std::string why;
  const auto place = Place::pattern(pattern, why);
  EXPECT_TRUE(place) << why;
  return place.value_or(Place::field(1, ','));
}

TEST(ScpiAnswer, ANumberStandsInAField) {
  EXPECT_EQ(found(Place::field(1, ','), "+5.3E-01"), "+5.3E-01");
  EXPECT_EQ(found(Place::field(2, ','), "1,+5.3E-01,7"), "+5.3E-01");
  EXPECT_EQ(found(Place::field(3, ';'), "1;2;3"), "3");
  EXPECT_EQ(found(Place::field(4, ';'), "1;2;3"), "none");
}

TEST(ScpiAnswer, OrWhereAPatternSays) {
  EXPECT_EQ(found(matching("([-+0-9.E]+) *ADC"), "CH1: +5.30E-01 ADC"), "+5.30E-01");
  EXPECT_EQ(found(matching("[0-9]+"), "I=17mA"), "17") << "without a group, all that matches";
  EXPECT_EQ(found(matching("^I=(x|[0-9]+)$"), "U=17"), "none");
  EXPECT_EQ(found(matching("(a+)+b"), std::string(80, 'a')), "none") << "at once, for it does not try all ways";
}

TEST(ScpiAnswer, APatternThatCannotBeReadSaysWhy) {
  std::string why;
  EXPECT_FALSE(Place::pattern("([0-9]+", why));
  EXPECT_NE(why, "");
  EXPECT_FALSE(Place::pattern("(.)\\1", why)) << "a back-reference";
  EXPECT_FALSE(Place::pattern("((.{99}){99}){99}", why)) << "a million states";
  EXPECT_FALSE(Place::pattern(std::string(101, '.'), why));
  EXPECT_FALSE(Place::pattern("", why));
}

TEST(ScpiAnswer, ANumberIsOneAsAWhole) {
  EXPECT_EQ(number_of(" +1.25E-03 "), 1.25e-3);
  EXPECT_EQ(number_of("-7"), -7);
  for (const char* text : {"", "+", "+-1", "1x", "0x10", "1,5", "nan", "INF", "1e999", "1 2", "--1"}) {
    EXPECT_FALSE(number_of(text)) << text;
  }
}

TEST(ScpiAnswer, LinesAreToldFromEachOther) {
  const Answers answers{.mode = "\"CURR\""};
  EXPECT_EQ(answers.classify("+5.3E-01").kind, Message::Kind::reading);
  EXPECT_DOUBLE_EQ(answers.classify("+5.3E-01").measurement.value, 0.53);
  EXPECT_TRUE(answers.classify("+9.9E+37").measurement.overload);
  EXPECT_TRUE(answers.classify("-9.9E+37").measurement.overload);
  EXPECT_EQ(answers.classify("OWON,XDM1041,2133,V3.3").kind, Message::Kind::prompt);
  EXPECT_EQ(answers.classify("\"CURR\"").kind, Message::Kind::function);
  EXPECT_EQ(answers.classify("\"CURR\"").measurement.quantity, Quantity::unsaid);
  EXPECT_EQ(answers.classify("\"VOLT\"").measurement.quantity, Quantity::other);
  EXPECT_EQ(Answers{}.classify("\"VOLT\"").kind, Message::Kind::noise) << "where the mode is not asked for";
  EXPECT_EQ(Answers{}.classify("").kind, Message::Kind::noise);
  EXPECT_EQ(Answers{.identity = "METER"}.classify("METER 7").kind, Message::Kind::prompt);
  EXPECT_EQ(Answers{.identity = "METER"}.classify("OWON,XDM1041,2133,V3.3").kind, Message::Kind::noise) << "another";
}

}  // namespace
}  // namespace emtb::scpi_meter
