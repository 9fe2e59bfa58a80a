#include "figures/figure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "figures/scale.h"
#include "tests/figures/xml.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::Pointwise;

const double gap = std::nan("");

std::vector<std::string> labels(const Scale& scale) {
  std::vector<std::string> list;
  for (const Tick& tick : scale.ticks())
    if (!tick.label.empty()) list.push_back(tick.label);
  return list;
}

Figure everything() {
  Figure f("A & B <test>", "every kind of trace");
  f.x({"t", "s"});
  f.panel({"ω", "rad/s"})
      .band("band", {0, 1, 2}, {-1, 0, 1}, {1, 2, 3})
      .line("line", {0, 1, 2}, {0, gap, 2}, {Ink::blue})
      .steps("steps", {0, 1, 2}, {0, 1, 2}, {Ink::vermilion})
      .points_with_errors("points", {0, 1, 2}, {0, 1, 2}, {-1, 0, 1}, {1, 2, 3}, {Ink::green})
      .reference(1, "floor & more")
      .shade(0.5, 1, "used")
      .note(1, 1, "T_{c} <here>");
  f.panel({"count", ""}).bars("bars", {0, 1, 2}, {3, 2, 1}).labels({"a", "b", "c"});
  return f;
}

TEST(NiceTicks, AreMultiplesOfOneTwoOrFive) {
  EXPECT_THAT(nice_ticks({0, 10}, 5), Pointwise(DoubleNear(1e-12), std::vector<double>{0, 2, 4, 6, 8, 10}));
  EXPECT_THAT(nice_ticks({-0.07, 0.11}, 4), Pointwise(DoubleNear(1e-12), std::vector<double>{-0.05, 0, 0.05, 0.1}));
  EXPECT_THAT(nice_ticks({3, 4.2}, 5),
              Pointwise(DoubleNear(1e-12), std::vector<double>{3, 3.2, 3.4, 3.6, 3.8, 4, 4.2}));
}

TEST(Scale, LabelsHaveOnlyTheDigitsThatDiffer) {
  EXPECT_THAT(labels(Scale({"y"}, {-0.4, 0.4}, 0, 4)), ElementsAre("−0.4", "−0.2", "0.0", "0.2", "0.4"));
  EXPECT_THAT(labels(Scale({"y"}, {0, 150}, 0, 3)), ElementsAre("0", "50", "100", "150"));
}

TEST(Scale, HasTwoTicksAtLeast) { EXPECT_GE(labels(Scale({"y"}, {-0.0079, 0.0092}, 0.06, 1)).size(), 2U); }

TEST(Scale, PutsALongPowerOfTenIntoTheTitle) {
  const Scale scale({"J", "kg m²"}, {0, 0.004}, 0, 4);
  EXPECT_EQ(scale.title(), "J [10⁻³ kg m²]");
  EXPECT_THAT(labels(scale), ElementsAre("0", "1", "2", "3", "4"));
}

TEST(Scale, GivesAUnitALetterInPlaceOfAPowerOfTen) {
  const Scale scale({"i_{a}", "A"}, {-0.012, 0.047}, 0, 4);
  EXPECT_EQ(scale.title(), "i_{a} [mA]");
  EXPECT_EQ(scale.ticks().back().label, "40");
}

TEST(Figure, SetsATitleInTwoLinesWhereOneIsTooShort) {
  Figure figure("What each absent effect promises, and by how much it would be");
  figure.wide(300).panel({"y", ""}).line("", {0, 1}, {0, 1});
  const std::string svg = to_svg(figure);
  EXPECT_THAT(svg, testing::Not(testing::HasSubstr(">" + figure.title + "</text>")));
  EXPECT_THAT(svg, testing::HasSubstr(">What each absent effect promises,"));
}

TEST(Scale, OfLogarithmsHasDecades) {
  const Scale scale({.label = "error", .log = true}, {1, 1000}, 0, 4);
  EXPECT_THAT(labels(scale), ElementsAre("1", "10", "100", "1000"));
  EXPECT_DOUBLE_EQ(scale.share(10), 1.0 / 3);
  EXPECT_TRUE(std::isnan(scale.share(0)));
}

TEST(Scale, OfLogarithmsWithinADecadeHasTicksToo) {
  EXPECT_THAT(labels(Scale({.label = "error", .log = true}, {1, 1.6}, 0, 4)), ElementsAre("1", "1.2", "1.4", "1.6"));
  EXPECT_THAT(labels(Scale({.label = "error", .log = true}, {0.9, 6}, 0, 4)),
              ElementsAre("1", "1.5", "2", "3", "4", "5", "6"));
}

TEST(Scale, GivesAConstantRoom) {
  const Scale scale({"y"}, {5, 5}, 0, 4);
  EXPECT_LT(scale.range().low, 5);
  EXPECT_GT(scale.range().high, 5);
  EXPECT_GE(scale.ticks().size(), 2U);
}

TEST(Thinned, KeepsPeaksGapsAndEndsOfALongSeries) {
  constexpr std::size_t n = 100000;
  std::vector<double> x(n), y(n);
  for (std::size_t k = 0; k < n; ++k) {
    x[k] = 700 * static_cast<double>(k) / n;
    y[k] = std::sin(0.7 * static_cast<double>(k));
  }
  y[54321] = 17;
  y[12345] = -23;
  y[80000] = gap;
  const Pixels p = thinned(x, y);
  EXPECT_LT(p.x.size(), 4U * 700 + 10);
  EXPECT_THAT(p.y, testing::Contains(17));
  EXPECT_THAT(p.y, testing::Contains(-23));
  EXPECT_EQ(std::ranges::count_if(p.y, [](double v) { return std::isnan(v); }), 1);
  EXPECT_EQ(p.x.front(), x.front());
  EXPECT_EQ(p.x.back(), x.back());
}

TEST(Thinned, LeavesOutWhatLiesOnAStraightLine) {
  std::vector<double> x, y;
  for (int k = 0; k <= 500; ++k) {
    x.push_back(k);
    y.push_back(k < 250 ? 0 : 2 * (k - 250));
  }
  const Pixels p = thinned(x, y);
  EXPECT_LT(p.x.size(), 16U);
  EXPECT_THAT(p.x, testing::Contains(250)) << "the corner stays";
}

TEST(Svg, IsWellFormedAndEscapesWhatItIsGiven) {
  for (const Theme theme : {Theme::page, Theme::standalone}) {
    const std::string svg = to_svg(everything(), theme);
    EXPECT_EQ(xml_error(svg), "");
    EXPECT_THAT(svg, HasSubstr("<title>A &amp; B &lt;test&gt;</title>"));
    EXPECT_THAT(svg, HasSubstr("floor &amp; more"));
    EXPECT_THAT(svg, Not(HasSubstr("nan")));
    EXPECT_THAT(svg, HasSubstr("T<tspan dy=\"2.5\" font-size=\"75%\">c</tspan>"));
  }
}

TEST(Svg, IsTheSameEachTime) { EXPECT_EQ(to_svg(everything()), to_svg(everything())); }

TEST(Svg, TakesColoursFromThePageOrBringsItsOwn) {
  const std::string page = to_svg(everything(), Theme::page), alone = to_svg(everything(), Theme::standalone);
  EXPECT_THAT(page, Not(HasSubstr("#")));
  EXPECT_THAT(page, HasSubstr("class=\"s-blue\""));
  EXPECT_THAT(alone, HasSubstr("stroke=\"#0072b2\""));
  EXPECT_THAT(alone, Not(HasSubstr("class=")));
  for (const char* name : {"s-blue", "f-vermilion", "f-words", "s-grid", "halo"})
    EXPECT_THAT(svg_style(), HasSubstr("." + std::string(name) + "{"));
  EXPECT_THAT(svg_style(), HasSubstr("prefers-color-scheme:dark"));
}

TEST(Svg, NamesCurvesAtTheirEndsOnlyWhereTheseAreApart) {
  Figure apart("", ""), together("", "");
  apart.x({"t", "s"}).panel({"y", ""}).line("one", {0, 1}, {0, 0}).line("two", {0, 1}, {0, 1}, {Ink::blue});
  together.x({"t", "s"}).panel({"y", ""}).line("one", {0, 1}, {0, 1}).line("two", {0, 1}, {1, 1}, {Ink::blue});
  EXPECT_THAT(to_svg(apart, Theme::page), HasSubstr("class=\"f-blue\">two<")) << "in its own colour";
  EXPECT_THAT(to_svg(together, Theme::page), HasSubstr("class=\"f-words\">two<")) << "in a legend";
}

TEST(Svg, OfALongNoisySeriesStaysSmall) {
  std::vector<double> t, y;
  for (int k = 0; k < 100000; ++k) {
    t.push_back(1e-3 * k);
    y.push_back(std::fmod(1.61803 * k, 1.0));
  }
  Figure f("noise", "");
  f.x({"t", "s"}).panel({"y", ""}).line("", t, y);
  EXPECT_LT(to_svg(f, Theme::page).size(), 40000U);
}

TEST(Svg, OfNothingIsAnEmptyFrame) {
  Figure f("empty", "");
  f.x({"t", "s"}).panel({"y", ""}).line("nothing", {}, {}).band("nor this", {}, {}, {});
  EXPECT_EQ(xml_error(to_svg(f)), "");
}

class Pictures : public Scratch {};

TEST_F(Pictures, PngHasItsSizeAndIsNotBlank) {
  Figure f("A line", "");
  f.wide(400).x({"t", "s"}).panel({"y", ""}, 100).line("", {0, 1}, {0, 1});
  write_png(f, path("line.png"), 2);
  const std::string png = read(path("line.png"));
  ASSERT_GT(png.size(), 1500U) << "a blank one takes less";
  EXPECT_EQ(png.substr(1, 3), "PNG");
  const auto number = [&](std::size_t at) {
    std::uint32_t n = 0;
    for (std::size_t i = 0; i < 4; ++i) n = n << 8 | static_cast<unsigned char>(png[at + i]);
    return n;
  };
  EXPECT_EQ(number(16), 800U);
  const std::string svg = to_svg(f);
  const auto height = svg.find(" height=\"");
  EXPECT_EQ(number(20), 2 * std::stoul(svg.substr(height + 9)));
}

TEST_F(Pictures, SayWhereTheyCannotBeWritten) {
  EXPECT_THAT(message_of<Error>([&] { write_png(everything(), path("no/such/folder.png")); }),
              HasSubstr("no/such/folder.png"));
  EXPECT_THAT(message_of<Error>([&] { write_svg(everything(), path("no/such/folder.svg")); }),
              HasSubstr("no/such/folder.svg"));
}

}  // namespace
}  // namespace emtb
