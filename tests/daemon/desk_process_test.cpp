#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "session/session.h"
#include "session/spec.h"
#include "tests/drivers/serial_daq/desk.h"
#include "tests/emtbd.h"
#include "tests/session/scratch.h"

namespace emtb::serial_daq {
namespace {

using nlohmann::json;

/// The real daemon on the shipped bench file, and the shipped sketch at the other end of a pseudo-terminal.
class StudentsDesk : public Scratch {
 protected:
  StudentsDesk() {
    std::string text = read(std::filesystem::path(EMTB_CONFIG) / "benches/desk-serial-daq.yaml");
    const std::size_t port = text.find("/dev/serial/by-id/");
    text.replace(port, text.find_first_of(" \n", port) - port, desk.port());
    config = write("bench.yaml", text);
    emtbd = std::make_unique<Process>(emtbd_words(config, path("")), path("emtbd"));
    daemon = client_of(*emtbd, path("s"));
  }
  void begin(const std::string& hold) {
    begin_run(*daemon, "name: step\nkind: step\nlevel: 3\nbefore: 0.5\nhold: " + hold + "\nafter: 0.5\n");
  }

  Desk desk;
  std::filesystem::path config;
  std::unique_ptr<Process> emtbd;
  std::unique_ptr<Client> daemon;
};

TEST_F(StudentsDesk, RunsAStepThroughTheSketch) {
  ASSERT_TRUE(daemon) << emtbd->err();
  begin("2");
  const json end = end_of_run(*daemon);
  ASSERT_EQ(end["outcome"], "done") << end << emtbd->err();
  const Session session = read_session(end["session"].get<std::string>());
  const auto& run = session.runs.at(0);
  const auto mean = [](const Series& series, double from, double to) {
    double sum = 0;
    int count = 0;
    for (std::size_t k = 0; k < series.t.size(); ++k) {
      if (series.t[k] < from || series.t[k] > to) continue;
      sum += series.value[k];
      ++count;
    }
    return sum / count;
  };
  const double omega = mean(run.at(Signal::omega), 1.5, 2.4);
  const double volts = mean(run.at(Signal::e_a), 1.5, 2.4);
  const double before = mean(run.at(Signal::omega), 0, 0.4);
  EXPECT_NEAR(volts, 6, 0.1);
  EXPECT_NEAR(omega, volts / (0.05 + 2 * 2e-5 / 0.05), 1) << "K_b and the friction's share of R_a";
  EXPECT_NEAR(before, 0, 0.1);
  EXPECT_NEAR(static_cast<double>(run.at(Signal::theta).t.size()), 600, 60) << "3 s of 200 Hz";
}

TEST_F(StudentsDesk, StopsByItsOwnWatchdogWhenDaemonAndGuardianAreKilled) {
  ASSERT_TRUE(daemon) << emtbd->err();
  begin("60");
  ASSERT_TRUE(eventually([&] { return desk.duty() > 0.4; }, 20));
  ASSERT_TRUE(kill_with_guardian(*emtbd));
  EXPECT_TRUE(eventually([&] { return desk.duty() == 0; }, 20));
  EXPECT_TRUE(desk.dropped());
  Process safe({EMTBD, "--config", config.string(), "--safe"}, path("safe"));
  EXPECT_EQ(safe.wait(), 0) << safe.err();
}

}  // namespace
}  // namespace emtb::serial_daq
