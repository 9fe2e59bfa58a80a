#include "drivers/comedi/mapping.h"

#include <gmock/gmock.h>

#include <array>
#include <cstring>
#include <random>

#include "drivers/comedi/open.h"
#include "drivers/connected.h"
#include "drivers/registry.h"
#include "hal/error.h"

namespace emtb::comedi {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::array six_thousand_series{Range{-10, 10}, Range{-5, 5}, Range{-0.5, 0.5}, Range{-0.05, 0.05}, Range{0, 10}};

TEST(ComediRange, IsTheNarrowestThatHoldsWhatIsWanted) {
  EXPECT_EQ(narrowest(six_thousand_series, {-10, 10}), 0U);
  EXPECT_EQ(narrowest(six_thousand_series, {-1, 1}), 1U);
  EXPECT_EQ(narrowest(six_thousand_series, {0, 6}), 4U);
  EXPECT_EQ(narrowest(six_thousand_series, {-0.05, 0.05}), 3U);
  EXPECT_EQ(narrowest(six_thousand_series, {-12, 12}), std::nullopt);
  EXPECT_EQ(narrowest({}, {0, 1}), std::nullopt);
}

TEST(ComediConverter, MapsTheEndsOfARangeToTheEndsOfItsCodes) {
  const Converter bipolar = nominal({-10, 10}, 4095);
  EXPECT_DOUBLE_EQ(bipolar.volts(0), -10);
  EXPECT_DOUBLE_EQ(bipolar.volts(4095), 10);
  comedi_range range{.min = -10, .max = 10, .unit = UNIT_volt};
  for (lsampl_t code = 1; code < 4095; code += 13) {
    EXPECT_NEAR(bipolar.volts(code), comedi_to_phys(code, &range, 4095), 1e-12) << "as the library's own";
    EXPECT_EQ(bipolar.code(bipolar.volts(code)), code);
  }
}

TEST(ComediConverter, NeverLeavesItsCodes) {
  const Converter output = nominal({0, 10}, 4095);
  EXPECT_EQ(output.code(-3), 0U);
  EXPECT_EQ(output.code(11), 4095U);
  EXPECT_EQ(output.code(6), 2457U);
}

TEST(ComediConverter, KnowsAnOverloadFromASensorAtRest) {
  const Converter bipolar = nominal({-10, 10}, 65535);
  EXPECT_TRUE(bipolar.saturated(0));
  EXPECT_TRUE(bipolar.saturated(65535));
  EXPECT_FALSE(bipolar.saturated(32768));
  const Converter unipolar = nominal({0, 10}, 65535);
  EXPECT_FALSE(unipolar.saturated(0)) << "a tacho at rest";
  EXPECT_TRUE(unipolar.saturated(65535));
}

TEST(ComediConverter, FollowsACalibrationsPolynomial) {
  Converter card = nominal({-10, 10}, 65535);
  card.to_volts = {.coefficients = {0.002, 3.1e-4, 1e-11, 0}, .expansion_origin = 32768, .order = 2};
  EXPECT_DOUBLE_EQ(card.volts(32768), 0.002);
  EXPECT_NEAR(card.volts(42768), 0.002 + 3.1 + 1e-3, 1e-12);
}

TEST(ComediChannelList, HoldsChannelRangeAndReference) {
  EXPECT_EQ(pack(5, 2, Wiring::single_ended), 0x00020005U);
  EXPECT_EQ(pack(5, 2, Wiring::common), 0x01020005U);
  EXPECT_EQ(pack(7, 0, Wiring::differential), 0x02000007U);
}

TEST(ComediCommand, TellsThePeriodThatTheCardMakes) {
  comedi_cmd command{};
  command.scan_begin_src = TRIG_TIMER;
  command.scan_begin_arg = 1'000'050;
  EXPECT_DOUBLE_EQ(scan_period(command, 3).value(), 1.00005e-3);
  command.scan_begin_src = TRIG_FOLLOW;
  command.convert_src = TRIG_TIMER;
  command.convert_arg = 10'000;
  EXPECT_DOUBLE_EQ(scan_period(command, 3).value(), 30e-6) << "a card with one clock: conversions follow each other";
  command.convert_src = TRIG_EXT;
  EXPECT_EQ(scan_period(command, 3), std::nullopt);
}

// ---- The bench file, and a machine without a card

const std::string bench_with_card =
    "name: b\n"                                                                                // 1
    "reference: {device: daq, channel: 1, min: 0, max: 6, safe: 0}\n"                          // 2
    "devices:\n"                                                                               // 3
    "  daq:\n"                                                                                 // 4
    "    driver: comedi\n"                                                                     // 5
    "    device: /dev/no_comedi\n"                                                             // 6
    "    rate: 500\n"                                                                          // 7
    "    channels:\n"                                                                          // 8
    "      omega: {channel: 3, wiring: differential, range: [0, 10], scale: 20, offset: 1}\n"  // 9
    "      e_a: {channel: 2, scale: 13}\n";                                                    // 10

BenchConfig card_bench(const std::string& from = "", const std::string& to = "") {
  std::string text = bench_with_card;
  return parse_bench(text.replace(text.find(from), from.size(), to), "b.yaml");
}

template <class E>
std::string refusal(const std::string& from, const std::string& to) {
  try {
    open_bench(card_bench(from, to));
  } catch (const E& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    return e.what();
  }
  return "";
}

TEST(Comedi, ReadsItsSettings) {
  const BenchConfig bench = card_bench();
  const InputSettings settings = read_settings(bench.devices[0].yaml, bench.rate);
  EXPECT_EQ(settings.card.node, "/dev/no_comedi");
  EXPECT_EQ(settings.rate, 500);
  ASSERT_EQ(settings.channels.size(), 2U);
  EXPECT_EQ(settings.channels[0].channel, 3U);
  EXPECT_EQ(settings.channels[0].wiring, Wiring::differential);
  EXPECT_EQ(settings.channels[0].wanted.min, 0);
  EXPECT_EQ(settings.channels[0].offset, 1);
  EXPECT_EQ(settings.channels[1].wanted.min, -10) << "where nothing else is said";
  EXPECT_EQ(read_output(bench.reference, settings.card).channel, 1U);
  read_settings(read_bench(EMTB_SOURCE_DIR "/config/benches/fh2-comedi.yaml").devices[0].yaml, 1000);  // as shipped
}

TEST(Comedi, EachMistakeHasItsLine) {
  EXPECT_EQ(refusal<ConfigError>("wiring: differential", "wiring: twisted"),
            "b.yaml:9: devices.daq.channels.omega.wiring is `twisted`. Known: single_ended, differential, common "
            "(against AISENSE)");
  EXPECT_THAT(refusal<ConfigError>("range: [0, 10]", "range: [10, 0]"), HasSubstr("b.yaml:9: "));
  EXPECT_THAT(refusal<ConfigError>("scale: 20, ", ""), HasSubstr("scale is missing: how many rad/s is one volt"));
  EXPECT_THAT(refusal<ConfigError>("e_a: {", "theta: {"), HasSubstr("is no voltage"));
  EXPECT_THAT(refusal<ConfigError>("rate: 500", "rate: 900000"), HasSubstr("b.yaml:7: devices.daq.rate"));
}

TEST(Comedi, SaysInOneLineWhyThereIsNoCard) {
  EXPECT_THAT(refusal<DeviceError>("", ""),
              HasSubstr("daq: /dev/no_comedi: is not there: no kernel driver has found the card. Load the card's own"));
  EXPECT_THAT(refusal<DeviceError>("/dev/no_comedi", "/dev/null"),
              HasSubstr("daq: /dev/null: is no comedi device. Name the card's node: ls /dev/comedi*"));
}

TEST(Comedi, NodesAreListedAndSubdevicesAreNot) {
  const std::filesystem::path dev =
      std::filesystem::path(::testing::TempDir()) / ("emtb_dev_" + std::to_string(getpid()));
  std::filesystem::create_directories(dev);
  for (const char* const name : {"comedi0", "comedi0_subd1", "comedi", "comedi12"}) {
    std::filesystem::create_symlink("/dev/null", dev / name);
  }
  std::vector<std::string> nodes;
  for (const auto& [node, board] : connected_cards(dev)) {
    nodes.push_back(std::filesystem::path(node).filename());
    EXPECT_EQ(board, "");
  }
  std::filesystem::remove_all(dev);
  EXPECT_THAT(nodes, ElementsAre("comedi0", "comedi12"));
}

}  // namespace
}  // namespace emtb::comedi
