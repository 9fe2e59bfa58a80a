#include "paper/estimate_figure.h"

#include <gmock/gmock.h>

namespace emtb {
namespace {

using testing::HasSubstr;

StaticEstimate points() {
  return {.title = "e_a = R_a i_a",
          .x_label = "i_{a}",
          .x_unit = "A",
          .y_label = "e_{a}",
          .y_unit = "V",
          .series = {{.name = "a/b/run.csv", .x = {1, 2}, .y = {3, 5}, .y_error = {0.1, 0.2}},
                     {.name = "a/b/curve.csv", .x = {1, 2}, .y = {3, 5}, .joined = true}}};
}

TEST(EstimateFigure, DrawsThePointsAlsoWhereThereIsNoResult) {
  StaticEstimate e = points();
  e.lacking = "needs more";
  ASSERT_TRUE(has_points(e));
  const Figure figure = figure_of(e);
  EXPECT_EQ(figure.title, "e_{a} = R_{a} i_{a}");
  ASSERT_EQ(figure.panels[0].traces.size(), 2U);
  EXPECT_EQ(figure.panels[0].traces[0].high[1], 5.2);
  EXPECT_EQ(figure.panels[0].traces[1].name, "curve.csv");
  EXPECT_FALSE(has_points(StaticEstimate{}));
}

TEST(EstimateFigure, ItsLineReachesToWhereTheInterceptIsRead) {
  StaticEstimate e = points();
  e.line = LineFit{.slope = 2, .intercept = 1};
  const Trace line = figure_of(e).panels[0].traces.back();
  EXPECT_THAT(line.name, HasSubstr("y = 2x + 1"));
  EXPECT_EQ(line.x, (std::vector<double>{0, 2}));
  EXPECT_EQ(line.y, (std::vector<double>{1, 5}));
}

}  // namespace
}  // namespace emtb
