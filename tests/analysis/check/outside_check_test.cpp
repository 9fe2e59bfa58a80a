// Recordings of benches that are not ours: nothing stops them as they are, and what is planted in them is found.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "config/mapping.h"
#include "config/model.h"
#include "session/spec.h"
#include "tests/analysis/check/sweep.h"
#include "tests/outside_data.h"

namespace emtb {
namespace {

const std::filesystem::path source = EMTB_SOURCE_DIR;

class OutsideCheck : public testing::Test {
 protected:
  using Run = emtb::Run;  // not testing::Test::Run

  void SetUp() override {
    if (const std::string none = no_outside_data(); !none.empty()) GTEST_SKIP() << none;
  }

  std::vector<Run> six(const std::string& folder) const {
    std::vector<Run> runs;
    for (const char* name : {"step_low", "step_high", "ramp", "random", "step_mid", "staircase"})
      runs.push_back(read_runs((folder_ / folder / (std::string(name) + ".csv")).string()).front());
    return runs;
  }

  void sweep(const std::string& name, const std::vector<Run>& runs, const std::optional<Model>& model,
             const std::vector<Signal>& sensors, const std::vector<Signal>& signs) {
    planted::Sweep s(name, runs, model ? &*model : nullptr);
    for (const DataFinding& f : s.healthy()) {
      EXPECT_FALSE(f.stops) << name << ": " << f.run << ": " << name_of(f.what) << ": " << f.text;
    }
    for (const Signal signal : sensors) s.plant_in_signal(signal, std::ranges::find(signs, signal) != signs.end());
    s.plant_in_rows();
    all_.add(s.counts());
  }

  const std::filesystem::path folder_ = outside_data();
  planted::Counts all_;
};

TEST_F(OutsideCheck, NothingStopsGoodRecordingsAndWhatIsPlantedIsNamed) {
  for (const char* c : {"a", "f"}) {
    sweep(std::string("gear_motor/") + c, six(std::string("gear_motor/") + c),
          read_model(folder_ / "gear_motor/model.yaml"), {Signal::theta, Signal::i_a}, {Signal::theta, Signal::i_a});
  }
  for (const std::string c : {"slow1", "fast2"}) {
    std::vector<Signal> signs{Signal::omega, Signal::e_a, Signal::i_a};
    std::vector<Signal> sensors{Signal::omega, Signal::e_a};
    if (c[0] == 'f') sensors.push_back(Signal::i_a);
    sweep("practice/" + c, six("practice/" + c), read_model(folder_ / "practice" / c / "model.yaml"), sensors, signs);
  }
  const auto runs = [&](const std::string& file, const std::filesystem::path& map) {
    return read_runs((folder_ / file).string(), read_mapping(map));
  };
  const auto ours = [&](const std::string& name) { return source / "config" / name; };
  sweep("emps", runs("emps/emps.csv", ours("mappings/emps.yaml")), read_model(ours("models/emps.yaml")),
        {Signal::theta}, {Signal::theta});
  sweep("inteco", runs("inteco_servo/inteco_servo.csv", ours("mappings/inteco.yaml")),
        read_model(ours("models/inteco.yaml")), {Signal::omega, Signal::theta}, {Signal::omega, Signal::theta});
  sweep("jga25", runs("jga25_steps/jga25_steps.csv", ours("mappings/jga25.yaml")),
        read_model(ours("models/jga25.yaml")), {Signal::omega}, {Signal::omega});
  sweep("qube", runs("qube/qube.csv", folder_ / "qube/map.yaml"), read_model(folder_ / "qube/model.yaml"),
        {Signal::theta}, {});
  Mapping pendulum;
  pendulum.run = "run";
  pendulum.columns = {{Signal::e_a, {.column = "e_a_V"}}, {Signal::theta, {.column = "theta_rad"}}};
  sweep("xl330", read_runs((folder_ / "xl330/xl330_pendulum.csv").string(), pendulum), {}, {Signal::theta},
        {Signal::theta});
  std::cout << all_.text() << "\n";
  // No worse than it was: 92 of 98 named, 8 beside.
  EXPECT_GE(all_.named, 0.92 * all_.planted);
  EXPECT_LE(all_.beside, 0.09 * all_.planted);
  if (all_.named < 0.95 * all_.planted || all_.beside > 0.05 * all_.planted) {
    GTEST_SKIP() << "the target is missed, 95 % named and 5 % beside: " << all_.text();
  }
  FAIL() << "the target is met: ask for it, and delete what stands for less";
}

}  // namespace
}  // namespace emtb
