#include <gmock/gmock.h>

#include "session/spec.h"
#include "tests/drivers/card_bench.h"
#include "tests/drivers/usb1608g/board.h"

namespace emtb::usb1608g {
namespace {

using nlohmann::json;

/// Output 0 drives the motor, inputs 0 to 2 see it.
class PlantAtTheCard {
 public:
  std::array<double, 16> operator()(double t, double out0) {
    motor_.advance(t - last_, out0);
    last_ = t;
    std::array<double, 16> inputs{};
    inputs[0] = motor_.tacho();
    inputs[1] = motor_.gauge();
    inputs[2] = motor_.armature();
    inputs[10] = -motor_.armature();
    return inputs;
  }

 private:
  MotorAtTerminals motor_;
  double last_ = 0;
};

class Usb1608gBench : public CardBench {
 protected:
  void SetUp() override { start("fh2-usb1608gx-2ao.yaml", "libumockdev-preload.so.0"); }

  MockKernel kernel;
  Board board{{}, PlantAtTheCard()};
  UsbPort port{kernel, 2, board};
};

TEST_F(Usb1608gBench, RunsAWholeStepExperimentThroughTheCard) {
  run_a_step(0.1, 0.1);
  EXPECT_EQ(std::ranges::max(board.written(0)), 42598) << "3 V, and never more";
  EXPECT_EQ(board.output(0), 0);
}

TEST_F(Usb1608gBench, WhoseCableIsPulledEndsTheRunByName) {
  begin_run(*daemon, "name: step\nkind: step\nlevel: 2\nbefore: 0\nhold: 60\nafter: 0\n");
  ASSERT_TRUE(eventually([&] { return board.output(0) > 1.9; }, 20)) << emtbd->err();
  port.unplug();
  const json ended = end_of_run(*daemon);
  EXPECT_EQ(ended["outcome"], "fault") << ended;
  EXPECT_THAT(ended["fault"]["code"].get<int>(), testing::AnyOf(301, 302))
      << "input or output, whichever sees it first";
  port.plug();
  EXPECT_TRUE(eventually([&] { return board.output(0) == 0; }, 20)) << "made safe as soon as it is back";
}

}  // namespace
}  // namespace emtb::usb1608g
