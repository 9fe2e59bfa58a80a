#include "report/page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/figures/xml.h"

namespace emtb {
namespace {

using testing::HasSubstr;
using testing::Not;

Page small_page(std::function<void(const NamedFigure&)> on_figure = {}) {
  Figure line("A line", "rising");
  line.x({"t", "s"}).panel({"y", ""}).line("", {0, 1}, {0, 1});
  Page page("About `fh2` & <others>", "1 run", std::move(on_figure));
  page.section("First").lead("T_{c} < 1 & more").list({"one", "two"}).code("emtb report 'a b.csv'");
  page.section("Second").table("Values", "lr", {"", "value"}, {{"R_{a}", "31.8"}});
  page.figure({"line", line, "It rises."}).small_multiples({{"left", line, ""}, {"right", line, ""}}, "Twice.");
  page.folded("Model", "a: <b>");
  return page;
}

TEST(Page, IsWellFormedAndNeedsNothingButItself) {
  const std::string html = small_page().html();
  const std::size_t body = html.find("<body>"), end = html.find("</html>");
  ASSERT_NE(body, std::string::npos);
  EXPECT_EQ(xml_error(html.substr(body, end - body)), "");
  EXPECT_THAT(html, Not(HasSubstr("<script")));
  EXPECT_THAT(html, Not(HasSubstr("src=")));
  EXPECT_THAT(html, Not(HasSubstr("@import")));
  EXPECT_THAT(html, Not(HasSubstr("url(")));
}

TEST(Page, EscapesTextAndKnowsSubscriptsAndCode) {
  const std::string html = small_page().html();
  EXPECT_THAT(html, HasSubstr("<h1>About <code>fh2</code> &amp; &lt;others&gt;</h1>"));
  EXPECT_THAT(html, HasSubstr("T<sub>c</sub> &lt; 1 &amp; more"));
  EXPECT_THAT(html, HasSubstr("a: &lt;b&gt;"));
  EXPECT_THAT(html, HasSubstr("<title>About fh2 &amp; &lt;others&gt;</title>")) << "no tags in a window's title";
}

TEST(Page, NamesTheRowsAndColumnsOfATable) {
  EXPECT_THAT(small_page().html(), testing::AllOf(HasSubstr("<th scope=\"row\">R<sub>a</sub></th>"),
                                                  HasSubstr("<th scope=\"col\" class=\"r\">value</th>"),
                                                  HasSubstr("<caption>Values</caption>")));
}

TEST(Page, FoldsWhatIsLong) {
  Page page("Title", "");
  page.section("Runs").fold("step.csv").paragraph("A figure").end_fold().fold("ramp.csv", true).end_fold();
  EXPECT_THAT(page.html(),
              testing::AllOf(HasSubstr("<details><summary>step.csv</summary>\n<p>A figure</p>\n</details>"),
                             HasSubstr("<details open=\"\"><summary>ramp.csv</summary>")));
}

TEST(Page, SaysFactsWordByWord) {
  Page page("Title", "");
  page.section("Verdict").facts({{"What is left", "i_{a} < 3 mA"}});
  EXPECT_THAT(page.html(), HasSubstr("<dt>What is left</dt><dd>i<sub>a</sub> &lt; 3 mA</dd>"));
}

TEST(Page, DrawsWhatIsWiderThanAPhoneOnceMoreForOne) {
  Figure wide("Wide"), small("Small");
  for (Figure* f : {&wide, &small}) f->panel({"y", ""}).line("", {0, 1}, {0, 1});
  small.wide(370);
  Page page("Title", "");
  page.section("Figures").side_by_side({{"wide", wide, ""}, {"small", small, ""}});
  const std::string html = page.html();
  EXPECT_THAT(html, testing::AllOf(HasSubstr("viewBox=\"0 0 820 "), HasSubstr("viewBox=\"0 0 380 "),
                                   HasSubstr("viewBox=\"0 0 370 "), HasSubstr("class=\"hero\"")));
}

TEST(Page, NamesEachCellOfALongTableForAPhone) {
  Page page("Title", "");
  page.section("Tables").table("Wide", "lrrr", {"", "R_{a} [Ω]", "p", "q"}, {{"row", "1", "2", "3"}});
  EXPECT_THAT(page.html(), testing::AllOf(HasSubstr("class=\"cards\""), HasSubstr("data-is=\"R_a [Ω]\"")));
}

TEST(Page, LinksToItsSections) {
  EXPECT_THAT(small_page().html(), testing::AllOf(HasSubstr("<a href=\"#s1\">Second</a>"), HasSubstr("id=\"s1\"")));
}

TEST(Page, HandsOutEachFigureAsItIsAdded) {
  std::vector<std::string> names;
  small_page([&](const NamedFigure& f) { names.push_back(f.name); });
  EXPECT_THAT(names, testing::ElementsAre("line", "left", "right"));
}

}  // namespace
}  // namespace emtb
