#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <nlohmann/json.hpp>

#include "drivers/simulated/plant.h"
#include "server/client.h"
#include "session/session.h"
#include "session/spec.h"
#include "tests/drivers/usb1608g/board.h"
#include "tests/process.h"
#include "tests/session/scratch.h"

namespace emtb::usb1608g {
namespace {

using nlohmann::json;

/// The FH2 at the card's terminals: output 0 drives it, inputs 0 to 2 see it as the shipped bench file says.
class PlantAtTheCard {
 public:
  std::array<double, 16> operator()(double t, double out0) {
    plant_.advance(std::max(t - last_, 1e-9), out0);
    last_ = t;
    std::array<double, 16> inputs{};
    inputs[0] = plant_.tacho() / 20;
    inputs[1] = plant_.gauge() / 0.2;
    inputs[2] = plant_.e_a() / 26;  // a differential pair about earth
    inputs[10] = -plant_.e_a() / 26;
    return inputs;
  }

 private:
  static simulated::PlantParameters fh2() {
    simulated::PlantParameters p;
    p.driver.gain = 110.0 / 6;
    p.driver.rise = 22.5;
    p.driver.fall = 20.4;
    p.driver.min = 0;
    p.driver.max = 110;
    p.motor.R_a = 31.825;
    p.motor.K_b = p.motor.K_m = 0.6739;
    p.motor.B = 1e-4;
    p.motor.J = 3.449e-3;
    p.friction.T_c = 0.0547;
    return p;
  }
  simulated::Plant plant_{fh2()};
  double last_ = 0;
};

/// The unmodified daemon in a process of its own, on the shipped bench file without its meter, and a card with a motor.
class Usb1608gBench : public Scratch {
 protected:
  void SetUp() override {
#if defined(__SANITIZE_ADDRESS__)
    GTEST_SKIP() << "AddressSanitizer's library and umockdev's both want to be the first that emtbd loads";
#endif
    std::string text = read(EMTB_SOURCE_DIR "/config/benches/fh2-usb1608gx-2ao.yaml");
    text.erase(text.find("  meter:\n"));
    config = write("bench.yaml", text);
    emtbd = std::make_unique<Process>(
        mocked({EMTBD, "--config", config.string(), "--socket", path("s").string(), "--data", path("data").string()}),
        path("emtbd"));
    eventually([&] {
      try {
        daemon = std::make_unique<Client>(path("s"));
        daemon->call("status", {});
        return true;
      } catch (const ProtocolError&) {
        return false;
      }
    });
    ASSERT_TRUE(daemon) << emtbd->err();
  }
  static std::vector<std::string> mocked(std::vector<std::string> words) {
    words.insert(words.begin(), {"/usr/bin/env", "LD_PRELOAD=libumockdev-preload.so.0"});
    return words;
  }
  void begin(const std::string& profile) {
    daemon->call("reset", {});
    daemon->call("subscribe", {{"rate", 1}});
    daemon->call("run", {{"profile", profile}});
  }
  json end() {
    json params;
    eventually([&] {
      const auto message = daemon->notification(1);
      if (message && (*message)["method"] == "ended") params = (*message)["params"];
      return !params.is_null();
    });
    return params;
  }

  MockKernel kernel;
  Board board{{}, PlantAtTheCard()};
  UsbPort port{kernel, 2, board};
  std::filesystem::path config;
  std::unique_ptr<Process> emtbd;
  std::unique_ptr<Client> daemon;
};

double value_at(const Series& series, double t) {
  const auto after = std::ranges::upper_bound(series.t, t);
  return after == series.t.begin() ? std::nan("")
                                   : series.value[static_cast<std::size_t>(after - series.t.begin() - 1)];
}

TEST_F(Usb1608gBench, RunsAWholeStepExperimentThroughTheCard) {
  begin("name: step\nkind: step\nlevel: 3\nbefore: 0.5\nhold: 4\nafter: 0.5\n");
  const json ended = end();
  ASSERT_EQ(ended["outcome"], "done") << ended << emtbd->err();
  const Session session = read_session(ended["session"].get<std::string>());
  const auto& run = session.runs.at(0);
  // settled at 55 V: K_m i = B omega + T_c and e_a = R_a i + K_b omega
  const double omega = (55 - 31.825 * 0.0547 / 0.6739) / (0.6739 + 31.825 * 1e-4 / 0.6739);
  EXPECT_NEAR(value_at(run.at(Signal::omega), 4.4), omega, 0.1);
  EXPECT_NEAR(value_at(run.at(Signal::e_a), 4.4), 55, 0.1);
  EXPECT_NEAR(value_at(run.at(Signal::e_a), 0.4), 0, 0.1);
  EXPECT_NEAR(value_at(run.at(Signal::e_a), 2), 22.5 * 1.5, 3) << "the driver's slope, on the loop's clock";
  EXPECT_EQ(value_at(run.at(Signal::u_ref), 2), 3);
  EXPECT_NEAR(static_cast<double>(run.at(Signal::omega).t.size()), 5000, 100) << "1 kHz for 5 s";
  EXPECT_EQ(std::ranges::max(board.written(0)), 42598) << "3 V, and never more";
  EXPECT_EQ(board.output(0), 0);
}

TEST_F(Usb1608gBench, ThatIsKilledIsMadeSafeBySafe) {
  begin("name: step\nkind: step\nlevel: 3\nbefore: 0\nhold: 60\nafter: 0\n");
  ASSERT_TRUE(eventually([&] { return board.output(0) > 2.9; }, 20)) << emtbd->err();
  emtbd->signal(SIGKILL);
  emtbd->wait();
  EXPECT_GT(board.output(0), 2.9) << "the card knows of nothing: a motor that turns";
  Process safe(mocked({EMTBD, "--config", config.string(), "--safe"}), path("safe"));
  EXPECT_EQ(safe.wait(), 0) << safe.err();
  EXPECT_EQ(board.output(0), 0);
}

TEST_F(Usb1608gBench, WhoseCableIsPulledEndsTheRunByName) {
  begin("name: step\nkind: step\nlevel: 2\nbefore: 0\nhold: 60\nafter: 0\n");
  ASSERT_TRUE(eventually([&] { return board.output(0) > 1.9; }, 20)) << emtbd->err();
  port.unplug();
  const json ended = end();
  EXPECT_EQ(ended["outcome"], "fault") << ended;
  EXPECT_THAT(ended["fault"]["code"].get<int>(), testing::AnyOf(301, 302))
      << "input or output, whichever sees it first";
  port.plug();
  EXPECT_TRUE(eventually([&] { return board.output(0) == 0; }, 20)) << "made safe as soon as it is back";
}

}  // namespace
}  // namespace emtb::usb1608g
