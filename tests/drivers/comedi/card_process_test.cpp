#include <gmock/gmock.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "session/spec.h"
#include "tests/drivers/card_bench.h"
#include "tests/drivers/comedi/card_file.h"

namespace emtb::comedi {
namespace {

using nlohmann::json;

/// A motor between the card's outputs and inputs, as the shipped bench file is wired.
class MotorAtTheCard {
 public:
  explicit MotorAtTheCard(Card& card) : card_(card), thread_([this] { turn(); }) {}
  ~MotorAtTheCard() {
    quit_ = true;
    thread_.join();
  }
  MotorAtTheCard(const MotorAtTheCard&) = delete;
  MotorAtTheCard& operator=(const MotorAtTheCard&) = delete;

 private:
  void turn() {
    using Clock = std::chrono::steady_clock;
    const auto began = Clock::now();
    MotorAtTerminals motor;
    for (double last = 0; !quit_;) {
      const double now = std::chrono::duration<double>(Clock::now() - began).count();
      motor.advance(now - last, card_.output(0));
      last = now;
      card_.inputs[0] = motor.tacho();
      card_.inputs[1] = motor.gauge();
      card_.inputs[2] = motor.armature();
      card_.inputs[10] = -motor.armature();
      std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
  }

  Card& card_;
  std::atomic<bool> quit_ = false;
  std::thread thread_;
};

class ComediBench : public CardBench {
 protected:
  void SetUp() override { start("fh2-comedi.yaml", EMTB_COMEDI_KERNEL, "/dev/comedi0", card.node()); }

  CardFile card;
  MotorAtTheCard motor{*card};
};

TEST_F(ComediBench, RunsAWholeStepExperimentThroughTheCard) {
  run_a_step(0.3, 0.2);  // 12 bit, on both ways
  EXPECT_NEAR(card.highest(), 2661, 2) << "3 V, and never more";
  EXPECT_NEAR(card->output(0), 0, 0.01);
}

TEST_F(ComediBench, ThatIsKilledIsMadeSafeByItsGuardianAndBySafe) {
  begin_run(*daemon, "name: step\nkind: step\nlevel: 3\nbefore: 0\nhold: 60\nafter: 0\n");
  ASSERT_TRUE(eventually([&] { return card->output(0) > 2.9; })) << emtbd->err();
  emtbd->signal(SIGKILL);
  emtbd->wait();
  EXPECT_TRUE(eventually([&] { return std::abs(card->output(0)) < 0.01; }, 20)) << "by its guardian";
  Process safe(with_card({EMTBD, "--config", config.string(), "--safe"}), path("safe"));
  EXPECT_EQ(safe.wait(), 0) << safe.err();
  EXPECT_NEAR(card->output(0), 0, 0.01);
}

TEST_F(ComediBench, WhoseCardGoesEndsTheRunByName) {
  begin_run(*daemon, "name: step\nkind: step\nlevel: 2\nbefore: 0\nhold: 60\nafter: 0\n");
  ASSERT_TRUE(eventually([&] { return card->output(0) > 1.9; })) << emtbd->err();
  card->present = false;
  const json ended = end_of_run(*daemon);
  EXPECT_EQ(ended["outcome"], "fault") << ended;
  EXPECT_THAT(ended["fault"]["code"].get<int>(), testing::AnyOf(301, 302))
      << "input or output, whichever sees it first";
  card->present = true;
  EXPECT_TRUE(eventually([&] { return std::abs(card->output(0)) < 0.01; })) << "made safe as soon as it is back";
}

}  // namespace
}  // namespace emtb::comedi
