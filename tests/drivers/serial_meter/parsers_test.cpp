#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <random>
#include <vector>

#include "drivers/serial_meter/es51922.h"
#include "drivers/serial_meter/fluke.h"
#include "drivers/serial_meter/fs9721.h"
#include "drivers/serial_meter/metex.h"
#include "drivers/serial_meter/scpi.h"
#include "tests/drivers/serial_meter/frames.h"

namespace emtb::serial_meter {
namespace {

using Kind = Message::Kind;

constexpr unsigned dc = 0b0111;  // FS9721: DC, AUTO, RS232
constexpr unsigned ac = 0b1011;

/// All messages but noise in a stream of bytes, fed one by one as a line delivers them.
std::vector<Message> heard(Find find, std::string_view stream) {
  std::vector<Message> messages;
  std::string received;
  for (const char byte : stream) {
    received += byte;
    while (!received.empty()) {
      const Message message = find(received);
      if (message.kind == Kind::partial) break;
      EXPECT_GE(message.length, 1U);
      EXPECT_LE(message.length, received.size());
      received.erase(0, message.length);
      if (message.kind != Kind::noise) messages.push_back(message);
    }
    EXPECT_LT(received.size(), 200U) << "no meter may fill the memory";
  }
  return messages;
}

std::vector<double> values(Find find, std::string_view stream) {
  std::vector<double> all;
  for (const Message& message : heard(find, stream)) {
    if (message.kind == Kind::reading && !message.measurement.overload) all.push_back(message.measurement.value);
  }
  return all;
}

/// Every stream that differs from `stream` by one byte lost, one byte caught, or all before some byte lost.
std::vector<std::string> damaged(const std::string& stream, std::string_view caught) {
  std::vector<std::string> all;
  for (std::size_t k = 0; k < stream.size(); ++k) {
    all.push_back(stream.substr(0, k) + stream.substr(k + 1));
    all.push_back(stream.substr(k));
    for (const char byte : caught) all.push_back(stream.substr(0, k) + byte + stream.substr(k));
  }
  return all;
}

/// Frames drawn at random, most of them near to a real one.
class Fuzz {
 public:
  explicit Fuzz(std::uint64_t seed) : engine_(seed) {}

  std::string frame(const std::vector<std::string>& real, std::string_view alphabet) {
    std::string text = real[below(real.size())];
    const std::size_t changes = below(4);
    for (std::size_t n = 0; n < changes; ++n) {
      const std::size_t where = below(text.size());
      switch (below(6)) {
        case 0:
          text[where] = static_cast<char>(below(256));
          break;
        case 1:
          text[where] = static_cast<char>(text[where] ^ static_cast<char>(1U << below(8)));
          break;
        case 2:
          std::swap(text[where], text[below(text.size())]);
          break;
        default:
          text[where] = alphabet[below(alphabet.size())];
          break;
      }
    }
    return text;
  }
  std::string noise(std::size_t length) {
    std::string text(length, '\0');
    for (char& c : text) c = static_cast<char>(below(256));
    return text;
  }
  std::size_t below(std::size_t n) { return engine_() % n; }

 private:
  std::mt19937_64 engine_;
};

/// EMTB_FUZZED_FRAMES=10000000 for a long look.
int fuzzed_frames_wanted() {
  const char* text = std::getenv("EMTB_FUZZED_FRAMES");
  return text == nullptr ? 200'000 : std::atoi(text);
}
const int fuzzed_frames = fuzzed_frames_wanted();

// ---- Metex

TEST(Metex, ReadsWhatItsMetersSend) {
  const auto volts = metex::parse("DC 1.2345   V\r");
  ASSERT_TRUE(volts);
  EXPECT_EQ(volts->value, 1.2345);
  EXPECT_EQ(volts->digit, 1e-4);
  EXPECT_EQ(volts->quantity, Quantity::voltage);
  EXPECT_EQ(volts->coupling, Coupling::dc);
  EXPECT_FALSE(volts->overload);
  EXPECT_FALSE(volts->altered);

  const auto current = metex::parse(metex_frame("DC", "- 012.3", "mA"));
  ASSERT_TRUE(current);
  EXPECT_DOUBLE_EQ(current->value, -0.0123);
  EXPECT_DOUBLE_EQ(current->digit, 1e-4);
  EXPECT_EQ(current->quantity, Quantity::current);

  EXPECT_EQ(metex::parse(metex_frame("AC", "0.530", "A"))->coupling, Coupling::ac);
  EXPECT_EQ(metex::parse(metex_frame("OH", "3.825", "KOhm"))->value, 3825);
  EXPECT_EQ(metex::parse(metex_frame("TE", "0023", "C"))->quantity, Quantity::temperature);
  EXPECT_TRUE(metex::parse(metex_frame("MX", "0.530", "A"))->altered);
  EXPECT_EQ(metex::parse(metex_frame("  ", "0.530", "A"))->coupling, Coupling::unsaid);
}

TEST(Metex, KnowsAnOverloadInEveryWriting) {
  for (const char* text : {".OL", "O.L", "OL.", "OL", "-.OL", "- O.L"}) {
    const auto m = metex::parse(metex_frame("DC", text, "A"));
    ASSERT_TRUE(m) << text;
    EXPECT_TRUE(m->overload) << text;
    EXPECT_EQ(m->quantity, Quantity::current);
  }
}

TEST(Metex, RefusesWhatNoMeterSends) {
  EXPECT_FALSE(metex::parse(""));
  EXPECT_FALSE(metex::parse("DC 1.2345   V"));
  EXPECT_FALSE(metex::parse("DC 1.2345   V\n"));
  for (const char* number : {"", "1.2.345", "12 345", "1.2x45", "--1.234", "Hi", "READY", ".", "0L"}) {
    EXPECT_FALSE(metex::parse(metex_frame("DC", number, "V"))) << number;
  }
  EXPECT_FALSE(metex::parse(metex_frame("DC", "1.2345", "Ohm"))) << "no DC resistance";
  EXPECT_FALSE(metex::parse(metex_frame("OH", "1.2345", "V")));
  EXPECT_FALSE(metex::parse(metex_frame("XY", "1.2345", "V")));
  EXPECT_FALSE(metex::parse(metex_frame("DC", "1.2345", "Vx")));
}

TEST(Metex, ALostOrACaughtByteNeverMakesAnotherValue) {
  const std::string two = metex_frame("DC", "1.2345", "V") + metex_frame("DC", "-6.789", "V");
  for (const std::string& stream : damaged(two, "DC 17.-V\r\n")) {
    for (const double value : values(metex::find, stream)) EXPECT_TRUE(value == 1.2345 || value == -6.789) << stream;
    const auto after = values(metex::find, stream + metex_frame("DC", "0.001", "V") + metex_frame("DC", "0.001", "V"));
    ASSERT_FALSE(after.empty());
    EXPECT_EQ(after.back(), 0.001) << "it finds its way back";
  }
}

TEST(Metex, AFuzzedFrameIsRefusedOrReadAsItStands) {
  const std::vector<std::string> real{metex_frame("DC", "1.2345", "V"), metex_frame("AC", "-0.530", "mA"),
                                      metex_frame("OH", "O.L", "MOhm"), metex_frame("DC", "012.3", "uA")};
  const std::map<char, double> prefixes{{'m', 1e-3}, {'u', 1e-6}, {'n', 1e-9}, {'p', 1e-12},
                                        {'K', 1e3},  {'k', 1e3},  {'M', 1e6}};
  Fuzz fuzz(14);
  int read = 0;
  for (int n = 0; n < fuzzed_frames; ++n) {
    const std::string frame = n % 8 == 0 ? fuzz.noise(14) : fuzz.frame(real, " +-.0123456789OLDCAVmukMhz\r");
    const auto m = metex::parse(frame);
    if (!m || m->overload) continue;
    ++read;
    std::string number;
    for (const char c : frame.substr(2, 7)) number += c == ' ' ? "" : std::string(1, c);
    std::string unit;
    for (const char c : frame.substr(9, 4)) unit += c == ' ' ? "" : std::string(1, c);
    const double prefix = unit.size() > 1 && prefixes.contains(unit[0]) ? prefixes.at(unit[0]) : 1;
    const double expected = std::strtod(number.c_str(), nullptr) * prefix;
    ASSERT_NEAR(m->value, expected, 1e-12 * std::abs(expected)) << frame;
    ASSERT_EQ(frame.back(), '\r');
  }
  EXPECT_GT(read, fuzzed_frames / 10);
}

// ---- FS9721

TEST(Fs9721, ReadsWhatItsMetersSend) {
  // 17 27 3d ...: 0.000 V DC as a VC820 sends it with its leads together
  const std::string zero = "\x17\x27\x3d\x4f\x5d\x67\x7d\x87\x9d\xa0\xb0\xc0\xd4\xe0";
  const auto m = fs9721::parse(zero);
  ASSERT_TRUE(m);
  EXPECT_EQ(m->value, 0);
  EXPECT_EQ(m->digit, 1e-3);
  EXPECT_EQ(m->quantity, Quantity::voltage);
  EXPECT_EQ(m->coupling, Coupling::dc);

  const auto current = fs9721::parse(fs9721_frame("-12.34", dc, 0, 0b1000, 0, 0b1000));
  ASSERT_TRUE(current);
  EXPECT_DOUBLE_EQ(current->value, -0.01234);
  EXPECT_DOUBLE_EQ(current->digit, 1e-5);
  EXPECT_EQ(current->quantity, Quantity::current);
  EXPECT_EQ(fs9721::parse(fs9721_frame("5678", ac, 0, 0, 0, 0b0100))->coupling, Coupling::ac);
  EXPECT_EQ(fs9721::parse(fs9721_frame("3.182", dc & 1U, 0b0010, 0, 0b0100, 0))->value, 3182);
  EXPECT_EQ(fs9721::parse(fs9721_frame("  .45", dc, 0, 0, 0, 0b0100))->value, 0.45) << "blanks before are zeros";
  EXPECT_EQ(fs9721::parse(fs9721_frame("0.612", 1, 0b0001, 0, 0, 0b0100))->quantity, Quantity::diode);
}

TEST(Fs9721, AHeldOrRelativeDisplayIsNotWhatTheLeadsSee) {
  EXPECT_FALSE(fs9721::parse(fs9721_frame("1.234", dc, 0, 0, 0, 0b0100))->altered);
  EXPECT_TRUE(fs9721::parse(fs9721_frame("1.234", dc, 0, 0, 0b0001, 0b0100))->altered);
  EXPECT_TRUE(fs9721::parse(fs9721_frame("1.234", dc, 0, 0, 0b0010, 0b0100))->altered);
}

TEST(Fs9721, KnowsAnOverload) {
  const auto m = fs9721::parse(fs9721_frame(" 0.L ", dc, 0, 0, 0, 0b1000));
  ASSERT_TRUE(m);
  EXPECT_TRUE(m->overload);
  EXPECT_EQ(m->quantity, Quantity::current);
}

TEST(Fs9721, RefusesWhatNoMeterSends) {
  EXPECT_FALSE(fs9721::parse(""));
  EXPECT_FALSE(fs9721::parse(fs9721_frame("1.234", 0b1111, 0, 0, 0, 0b0100))) << "AC and DC together";
  EXPECT_FALSE(fs9721::parse(fs9721_frame("1.234", 0b0110, 0, 0, 0, 0b0100))) << "not sent to RS-232";
  EXPECT_FALSE(fs9721::parse(fs9721_frame("1.234", dc, 0b0010, 0b1000, 0, 0b0100))) << "kilo and milli";
  EXPECT_FALSE(fs9721::parse(fs9721_frame("1.234", dc, 0, 0, 0, 0b1100))) << "volt and ampere";
  EXPECT_FALSE(fs9721::parse(fs9721_frame("1.2.34", dc, 0, 0, 0, 0b0100))) << "two points";
  EXPECT_FALSE(fs9721::parse(fs9721_frame("1 34", dc, 0, 0, 0, 0b0100))) << "a blank among digits";
  EXPECT_FALSE(fs9721::parse(fs9721_frame("    ", dc, 0, 0, 0, 0b0100)));
  EXPECT_FALSE(fs9721::parse(fs9721_frame("12L4", dc, 0, 0, 0, 0b0100)));
  std::string dim = fs9721_frame("8888", dc, 0, 0, 0, 0b0100);
  dim[1] = static_cast<char>(dim[1] & ~1);  // segments that no digit has
  EXPECT_FALSE(fs9721::parse(dim));
}

TEST(Fs9721, ALostOrACaughtByteNeverMakesAnotherValue) {
  const std::string two = fs9721_frame("1.234", dc, 0, 0, 0, 0b0100) + fs9721_frame("-5.678", dc, 0, 0, 0, 0b0100);
  const std::string last = fs9721_frame("0.001", dc, 0, 0, 0, 0b0100);
  for (const std::string& stream : damaged(two, two)) {
    for (const double value : values(fs9721::find, stream)) EXPECT_TRUE(value == 1.234 || value == -5.678);
    const auto after = values(fs9721::find, stream + last);
    ASSERT_FALSE(after.empty());
    EXPECT_EQ(after.back(), 0.001) << "it finds its way back at once";
  }
}

TEST(Fs9721, AFuzzedFrameIsRefusedOrReadAsItStands) {
  const std::vector<std::string> real{
      fs9721_frame("1.234", dc, 0, 0, 0, 0b0100), fs9721_frame("-56.78", ac, 0, 0b1000, 0, 0b1000),
      fs9721_frame("999.9", 1, 0b0010, 0, 0b0100, 0), fs9721_frame(" 0L ", dc, 0, 0, 0, 0b0100)};
  std::map<unsigned, char> shown{{0U, ' '}};
  for (char c = '0'; c <= '9'; ++c) shown[lcd(c)] = c;
  Fuzz fuzz(9721);
  int read = 0;
  for (int n = 0; n < fuzzed_frames; ++n) {
    std::string frame = n % 8 == 0 ? fuzz.noise(14) : real[fuzz.below(real.size())];
    for (std::size_t k = 0; k < fuzz.below(4); ++k) {
      char& byte = frame[fuzz.below(frame.size())];
      byte = static_cast<char>(byte ^ static_cast<char>(1U << fuzz.below(fuzz.below(4) == 0 ? 8 : 4)));
    }
    const auto m = fs9721::parse(frame);
    if (!m) continue;
    for (std::size_t k = 0; k < 14; ++k) ASSERT_EQ(static_cast<unsigned char>(frame[k]) >> 4U, k + 1);
    if (m->overload) continue;
    ++read;
    std::string text = (frame[1] & 8) != 0 ? "-" : "";
    for (std::size_t k = 1; k < 9; k += 2) {
      if (k > 1 && (frame[k] & 8) != 0) text += '.';
      const unsigned segments =
          (static_cast<unsigned>(frame[k]) & 7U) << 4U | (static_cast<unsigned>(frame[k + 1]) & 15U);
      ASSERT_TRUE(shown.contains(segments));
      if (shown[segments] != ' ') text += shown[segments];
    }
    const auto lit = [&](std::size_t byte, int bit) { return (frame[byte - 1] >> bit & 1) != 0; };
    const double prefix = (lit(10, 3) ? 1e-6 : 1) * (lit(10, 2) ? 1e-9 : 1) * (lit(10, 1) ? 1e3 : 1) *
                          (lit(11, 3) ? 1e-3 : 1) * (lit(11, 2) ? 1e-2 : 1) * (lit(11, 1) ? 1e6 : 1);
    const double expected = std::strtod(text.c_str(), nullptr) * prefix;
    ASSERT_NEAR(m->value, expected, 1e-12 * std::abs(expected)) << text;
  }
  EXPECT_GT(read, fuzzed_frames / 10);
}

// ---- ES51922

TEST(Es51922, ReadsWhatItsMetersSend) {
  const auto good = es51922::parse("012345;00080\r\n");
  ASSERT_TRUE(good);
  EXPECT_EQ(good->value, 1.2345);
  EXPECT_EQ(good->digit, 1e-4);
  EXPECT_EQ(good->quantity, Quantity::voltage);
  EXPECT_EQ(good->coupling, Coupling::dc);
  EXPECT_EQ(es51922::parse(es51922_frame('1', "12345", ';', 0b0100))->value, -12.345);
  EXPECT_DOUBLE_EQ(es51922::parse(es51922_frame('4', "21999", ';'))->value, 0.21999);

  const auto current = es51922::parse(es51922_frame('0', "00530", '0'));
  ASSERT_TRUE(current);
  EXPECT_EQ(current->value, 0.530);
  EXPECT_EQ(current->quantity, Quantity::current);
  EXPECT_DOUBLE_EQ(es51922::parse(es51922_frame('0', "22000", '?'))->value, 22e-3);
  EXPECT_DOUBLE_EQ(es51922::parse(es51922_frame('0', "22000", '='))->value, 220e-6);
  EXPECT_EQ(es51922::parse(es51922_frame('0', "12345", '3'))->quantity, Quantity::resistance);
  EXPECT_DOUBLE_EQ(es51922::parse(es51922_frame('0', "00500", '2', 0b1000))->value, 0.5) << "a duty cycle of 50 %";
  EXPECT_EQ(es51922::parse(es51922_frame('0', "12345", ';', 0, 0, 0, 0b0100))->coupling, Coupling::ac);
}

TEST(Es51922, KnowsAnOverloadWhateverTheDigitsShow) {
  const auto m = es51922::parse(es51922_frame('0', "1:?45", '0', 0b0001));
  ASSERT_TRUE(m);
  EXPECT_TRUE(m->overload);
  EXPECT_EQ(m->quantity, Quantity::current);
}

TEST(Es51922, WhatIsNotTheLeadsReadingIsAltered) {
  EXPECT_FALSE(es51922::parse(es51922_frame('0', "12345", ';'))->altered);
  EXPECT_TRUE(es51922::parse(es51922_frame('0', "12345", ';', 0, 0b0010))->altered) << "relative";
  EXPECT_TRUE(es51922::parse(es51922_frame('0', "12345", ';', 0, 0b1000))->altered) << "maximum";
  EXPECT_TRUE(es51922::parse(es51922_frame('0', "12345", ';', 0, 0, 0b0100))->altered) << "peak";
  EXPECT_TRUE(es51922::parse(es51922_frame('0', "12345", ';', 0, 0, 0, 0b1000, 0b0010))->altered) << "held";
  EXPECT_EQ(es51922::parse(es51922_frame('0', "12345", ';', 0, 0, 0, 0b1001))->quantity, Quantity::other) << "Hz of V";
}

TEST(Es51922, RefusesWhatNoMeterSends) {
  EXPECT_FALSE(es51922::parse(""));
  EXPECT_FALSE(es51922::parse(es51922_frame('7', "12345", ';'))) << "no such range";
  EXPECT_FALSE(es51922::parse(es51922_frame('2', "12345", '2'))) << "a range that the chip leaves out";
  EXPECT_FALSE(es51922::parse(es51922_frame('0', "12:45", ';'))) << "no digit";
  EXPECT_FALSE(es51922::parse(es51922_frame('0', "12345", '8'))) << "no such function";
  EXPECT_FALSE(es51922::parse(es51922_frame('0', "12345", ';', 0, 0, 0, 0))) << "neither AC nor DC";
  std::string parity = es51922_frame('0', "12345", ';');
  parity[3] = '\0';  // how a byte of the wrong parity is read
  EXPECT_FALSE(es51922::parse(parity));
}

TEST(Es51922, ALostOrACaughtByteNeverMakesAnotherValue) {
  const std::string two = es51922_frame('0', "12345", ';') + es51922_frame('1', "06789", ';', 0b0100);
  const std::string last = es51922_frame('0', "00010", ';');
  for (const std::string& stream : damaged(two, "0123456789;\r\n")) {
    for (const double value : values(es51922::find, stream)) EXPECT_TRUE(value == 1.2345 || value == -6.789) << stream;
    const auto after = values(es51922::find, stream + last + last);
    ASSERT_FALSE(after.empty());
    EXPECT_EQ(after.back(), 0.001) << "it finds its way back";
  }
}

TEST(Es51922, AFuzzedFrameIsRefusedOrReadAsItStands) {
  const std::vector<std::string> real{es51922_frame('0', "12345", ';'), es51922_frame('0', "00530", '0', 0b0100),
                                      es51922_frame('3', "22000", '3'), es51922_frame('1', "21999", '?', 0b0001)};
  // The last digit of each range, written down from the table of the meter's display.
  const std::map<char, std::string> last_digit{{';', "1e-4 1e-3 1e-2 1e-1 1e-5"},
                                               {'=', "1e-8 1e-7"},
                                               {'?', "1e-6 1e-5"},
                                               {'0', "1e-3"},
                                               {'3', "1e-2 1e-1 1e+0 1e+1 1e+2 1e+3 1e+4"}};
  Fuzz fuzz(51922);
  int read = 0;
  for (int n = 0; n < fuzzed_frames; ++n) {
    const std::string frame = n % 8 == 0 ? fuzz.noise(14) : fuzz.frame(real, "0123456789:;<=>?\r\n");
    const auto m = es51922::parse(frame);
    if (!m || m->overload || !last_digit.contains(frame[6])) continue;
    ++read;
    const std::string& digits = last_digit.at(frame[6]);
    const auto range = static_cast<std::size_t>(frame[0] - '0');
    ASSERT_LT(range * 5, digits.size()) << frame;
    const double expected = std::strtod(frame.substr(1, 5).c_str(), nullptr) *
                            std::strtod(digits.substr(range * 5, 4).c_str(), nullptr) * ((frame[7] & 4) != 0 ? -1 : 1);
    ASSERT_NEAR(m->value, expected, 1e-12 * std::abs(expected)) << frame;
    ASSERT_EQ(frame.substr(12), "\r\n");
  }
  EXPECT_GT(read, fuzzed_frames / 10);
}

// ---- SCPI

TEST(Scpi, SortsWhatTheMetersAnswer) {
  const auto messages = heard(scpi::find, "+1.23456789E-01\r\n\"CURR\"\n-9.90000000E+37\r\"VOLT:AC\"\r\n");
  ASSERT_EQ(messages.size(), 4U);
  EXPECT_EQ(messages[0].kind, Kind::reading);
  EXPECT_DOUBLE_EQ(messages[0].measurement.value, 0.123456789);
  EXPECT_EQ(messages[1].kind, Kind::function);
  EXPECT_EQ(messages[1].measurement.quantity, Quantity::current);
  EXPECT_EQ(messages[1].measurement.coupling, Coupling::dc);
  EXPECT_EQ(messages[2].kind, Kind::reading);
  EXPECT_TRUE(messages[2].measurement.overload);
  EXPECT_EQ(messages[3].measurement.quantity, Quantity::voltage);
  EXPECT_EQ(messages[3].measurement.coupling, Coupling::ac);
  EXPECT_EQ(scpi::classify("\"CURR:DC\"").measurement.quantity, Quantity::current);
  EXPECT_EQ(scpi::classify("+0,\"No error\"").kind, Kind::prompt);
  EXPECT_EQ(scpi::classify("-113,\"Undefined header\"").kind, Kind::prompt);
  EXPECT_EQ(scpi::classify(",\"\"").kind, Kind::noise);
  EXPECT_EQ(scpi::classify("\"NONSENSE\"").measurement.quantity, Quantity::other) << "none that anyone asked for";
}

TEST(Scpi, RefusesWhatIsNoReading) {
  EXPECT_TRUE(scpi::parse("9.9E37")->overload) << "as the Keithley 2000 writes it";
  for (const char* text : {"", "+", "E", "1", "+1.5", "+1.5E", "+1.5E+", "+1.5E+0", "+1.5E+123", "+12.5E+00",
                           "+1.E+00 ", "+.5E+00", "++1.5E+00", "nan", "+1.5E+0x", "+1.5e+00", "HP34401A"}) {
    EXPECT_FALSE(scpi::parse(text)) << text;
  }
  EXPECT_FALSE(scpi::parse("+9.90000000E+3")) << "a truncated overload is no reading of 9900";
}

TEST(Scpi, ALineThatNeverEndsIsNoise) {
  EXPECT_TRUE(heard(scpi::find, std::string(10'000, '1')).empty());
  EXPECT_EQ(values(scpi::find, std::string(300, 'x') + "\n+1.50000000E+00\n"), std::vector{1.5});
}

TEST(Scpi, AFuzzedLineIsRefusedOrReadAsItStands) {
  const std::vector<std::string> real{"+1.23456789E-01", "-9.87654321E+02", "+9.90000000E+37", "1.5E+00",
                                      "\"CURR:AC\""};
  Fuzz fuzz(34401);
  int read = 0;
  for (int n = 0; n < fuzzed_frames; ++n) {
    std::string line = n % 8 == 0 ? fuzz.noise(fuzz.below(40)) : fuzz.frame(real, "+-.E0123456789\"");
    if (fuzz.below(4) == 0) line.resize(fuzz.below(line.size() + 1));
    heard(scpi::find, line + "\n");
    const auto m = scpi::parse(line);
    if (!m) continue;
    ++read;
    char* end = nullptr;
    const double expected = std::strtod(line.c_str(), &end);
    ASSERT_EQ(end, line.c_str() + line.size()) << line;
    ASSERT_EQ(m->overload, std::abs(expected) >= 9e37) << line;
    if (m->overload) continue;
    ASSERT_NEAR(m->value, expected, 1e-12 * std::abs(expected)) << line;
  }
  EXPECT_GT(read, fuzzed_frames / 10);
}

TEST(Scpi, SetsFunctionRangeAndIntegration) {
  const Function current{"dc_current", Quantity::current, Coupling::dc, "A"};
  EXPECT_EQ(scpi::set_up(current, 3, 10),
            (std::vector<std::string>{"\n", "*CLS\n", "SYST:REM\n", "CONF:CURR:DC 3\n", "CURR:DC:NPLC 10\n"}));
  EXPECT_EQ(scpi::set_up({"ac_voltage", Quantity::voltage, Coupling::ac, "V"}, 0, 10).back(), "CONF:VOLT:AC\n");
  EXPECT_TRUE(scpi::set_up({"temperature", Quantity::temperature, Coupling::unsaid, "degC"}, 0, 10).empty());
}

// ---- Fluke 45, 8808A

TEST(Fluke, SortsWhatTheMetersAnswer) {
  const auto messages =
      heard(fluke::find, "MEAS1?\r\n+1.2345E+0 VDC\r\n=>\r\n+530.1E-3\r\n?>\r\n!>\r\n-5.301E-1 ADC\r\n");
  ASSERT_EQ(messages.size(), 5U) << "neither the echo nor 530.1E-3 is an answer";
  EXPECT_EQ(messages[0].kind, Kind::reading);
  EXPECT_EQ(messages[0].measurement.value, 1.2345);
  EXPECT_EQ(messages[0].measurement.digit, 1e-4);
  EXPECT_EQ(messages[0].measurement.quantity, Quantity::voltage);
  EXPECT_EQ(messages[1].kind, Kind::prompt);
  EXPECT_EQ(messages[2].kind, Kind::refusal);
  EXPECT_EQ(messages[3].kind, Kind::refusal);
  EXPECT_DOUBLE_EQ(messages[4].measurement.value, -0.5301);
  EXPECT_EQ(messages[4].measurement.coupling, Coupling::dc);
}

TEST(Fluke, KnowsAnOverloadAndAFormatWithoutUnits) {
  EXPECT_TRUE(fluke::parse("+1E+9")->overload);
  EXPECT_TRUE(fluke::parse("+1E+9 AAC")->overload);
  EXPECT_EQ(fluke::parse("+1.2345E+0")->quantity, Quantity::unsaid);
  EXPECT_EQ(fluke::parse("+1.2345E+0 AACDC")->coupling, Coupling::ac_and_dc);
}

TEST(Fluke, RefusesWhatIsNoReading) {
  for (const char* text : {"", "+", "+1", "+1.2", "1.2E+0", "+1.2E0", "+1.2E+", "+.2E+0", "+1.E+0", "+12E+0",
                           "+1.2E+0 XDC", "+1.2E+0 ", "+1.2E+0 VDC, +3.4E+0 ADC", "+1.2E+00"}) {
    EXPECT_FALSE(fluke::parse(text)) << text;
  }
}

TEST(Fluke, AFuzzedLineIsRefusedOrReadAsItStands) {
  const std::vector<std::string> real{"+1.2345E+0 VDC", "-5.301E-1 ADC", "+1E+9 AAC", "+1.2345E+0", "=>"};
  Fuzz fuzz(45);
  int read = 0;
  for (int n = 0; n < fuzzed_frames; ++n) {
    std::string line = n % 8 == 0 ? fuzz.noise(fuzz.below(40)) : fuzz.frame(real, "+-.E0123456789 VADC");
    if (fuzz.below(4) == 0) line.resize(fuzz.below(line.size() + 1));
    heard(fluke::find, line + "\r\n");
    const auto m = fluke::parse(line);
    if (!m) continue;
    ++read;
    const double expected = std::strtod(line.substr(0, line.find(' ')).c_str(), nullptr);
    ASSERT_EQ(m->overload, std::abs(expected) >= 1e9) << line;
    if (m->overload) continue;
    ASSERT_NEAR(m->value, expected, 1e-12 * std::abs(expected)) << line;
  }
  EXPECT_GT(read, fuzzed_frames / 10);
}

TEST(Fluke, SetsFunctionUnitsAndSpeed) {
  EXPECT_EQ(fluke::set_up({"dc_current", Quantity::current, Coupling::dc, "A"}),
            (std::vector<std::string>{"REMS\r", "FORMAT 2\r", "ADC\r", "RATE S\r"}));
  EXPECT_TRUE(fluke::set_up({"temperature", Quantity::temperature, Coupling::unsaid, "degC"}).empty());
}

}  // namespace
}  // namespace emtb::serial_meter
