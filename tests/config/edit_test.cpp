#include "config/edit.h"

#include <gmock/gmock.h>

#include <array>

#include "hal/error.h"

namespace emtb {
namespace {

using ::testing::HasSubstr;

const std::string bench_text =
    "# a bench; 20 is said here too\n"
    "devices:\r\n"
    "  daq:\n"
    "    channels:           # reading = scale * volts + offset\n"
    "      omega: {channel: 0, range: 10, scale: 20}       # [rad/s] tacho, \xC2\xB1 5 %\n"
    "      torque:\n"
    "        channel: 1      # the gauge\n"
    "        scale: 0.2      # [N m]\n"
    "      e_a: {channel: 2}\n"
    "      i_f: &same {channel: 3, scale: 1}\n"
    "  other:\n"
    "    channels: {i_a: *same}\n";

const std::array new_numbers{KeyedNumber{"scale", -19.87654321}, KeyedNumber{"offset", 0.0125}};

std::string edited_channel(const std::string& device, const std::string& signal,
                           const std::string& note = "calibrated 2026-11-21: residual 0.1") {
  const std::array<std::string, 4> path{"devices", device, "channels", signal};
  return edited(bench_text, "b.yaml", path, new_numbers, note);
}

std::string with(const std::string& from, const std::string& to) {
  std::string text = bench_text;
  return text.replace(text.find(from), from.size(), to);
}

TEST(Edit, ChangesTheNumbersOfOneMapAndLeavesEverythingElse) {
  EXPECT_EQ(edited_channel("daq", "omega"),
            with("{channel: 0, range: 10, scale: 20}       # [rad/s] tacho, \xC2\xB1 5 %",
                 "{offset: 0.0125, channel: 0, range: 10, scale: -19.8765}       # [rad/s] tacho, \xC2\xB1 5 %; "
                 "calibrated 2026-11-21: residual 0.1"));
}

TEST(Edit, AddsKeysThatAMapDidNotHave) {
  EXPECT_EQ(
      edited_channel("daq", "e_a"),
      with("{channel: 2}", "{offset: 0.0125, scale: -19.8765, channel: 2}   # calibrated 2026-11-21: residual 0.1"));
  EXPECT_EQ(edited_channel("daq", "torque"),
            with("channel: 1      # the gauge\n        scale: 0.2 ",
                 "offset: 0.0125   # calibrated 2026-11-21: residual 0.1\n        channel: 1      # the gauge\n        "
                 "scale: -19.8765 "));
}

TEST(Edit, ReplacesTheNoteOfTheTimeBefore) {
  const std::array<std::string, 4> path{"devices", "daq", "channels", "omega"};
  const std::string once = edited(bench_text, "b.yaml", path, new_numbers, "calibrated 2026-11-21: residual 0.1");
  const std::string twice = edited(once, "b.yaml", path, new_numbers, "calibrated 2027-01-02: residual 0.2");
  EXPECT_THAT(twice, HasSubstr("5 %; calibrated 2027-01-02: residual 0.2\n"));
  EXPECT_EQ(twice.find("2026"), std::string::npos);
  EXPECT_EQ(twice.size(), once.size());
}

TEST(Edit, RefusesWhatWouldChangeAnotherPlaceToo) {
  try {
    edited_channel("other", "i_a");
    FAIL() << "the anchor's own channel would change with it";
  } catch (const ConfigError& e) {
    EXPECT_THAT(e.what(), HasSubstr("b.yaml:"));
    EXPECT_THAT(e.what(), HasSubstr("by hand"));
  }
}

}  // namespace
}  // namespace emtb
