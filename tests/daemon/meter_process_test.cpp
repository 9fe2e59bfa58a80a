#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <nlohmann/json.hpp>

#include "session/session.h"
#include "session/spec.h"
#include "tests/drivers/pseudo_terminal.h"
#include "tests/drivers/serial_meter/frames.h"
#include "tests/emtbd.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

using nlohmann::json;

/// The real daemon on the shipped bench with a Metex, whose meter is at the other end of a pseudo-terminal.
class MetexBench : public Scratch {
 protected:
  MetexBench() {
    std::string text = read(std::filesystem::path(EMTB_CONFIG) / "benches/fh2-metex.yaml");
    const std::size_t port = text.find("/dev/serial/by-id/");
    text.replace(port, text.find_first_of(" \n", port) - port, line.path());
    emtbd = std::make_unique<Process>(emtbd_words(write("bench.yaml", text), path("")), path("emtbd"));
    daemon = client_of(*emtbd, path("s"));
  }

  /// Runs the reference at zero for so long. How it ended.
  json run(
      double seconds, const std::function<void()>& meanwhile = [] {}) {
    begin_run(*daemon,
              "name: still\nkind: step\nlevel: 0.1\nbefore: 0\nhold: " + std::to_string(seconds) + "\nafter: 0\n");
    meanwhile();
    return end_of_run(*daemon);
  }

  std::atomic<bool> overloaded = false;
  PseudoTerminal line;
  AtTheOtherEnd metex{[this] {
    for (const char c : line.read(0.005)) {
      if (c == 'D') line.write(serial_meter::metex_frame("DC", overloaded ? "O.L" : "0.530", "A"));
    }
  }};
  std::unique_ptr<Process> emtbd;
  std::unique_ptr<Client> daemon;
};

TEST_F(MetexBench, ItsReadingsAreInTheSession) {
  ASSERT_TRUE(daemon) << emtbd->err();
  const json end = run(3);
  ASSERT_EQ(end["outcome"], "done") << end;
  const Session session = read_session(end["session"].get<std::string>());
  const Series& current = session.runs.at(0).at(Signal::i_a);
  EXPECT_NEAR(static_cast<double>(current.t.size()), 7, 2) << "3 s of 0.4 s";
  for (const double value : current.value) EXPECT_DOUBLE_EQ(value, 0.530);
  EXPECT_TRUE(std::ranges::is_sorted(current.t));
}

TEST_F(MetexBench, AnOverloadEndsTheRunAndIsNamed) {
  ASSERT_TRUE(daemon) << emtbd->err();
  const json end = run(60, [this] { overloaded = true; });
  EXPECT_EQ(end["outcome"], "fault") << end;
  EXPECT_EQ(end["fault"]["code"], 203) << end;
  EXPECT_THAT(end["fault"]["text"].get<std::string>(), testing::HasSubstr("over_range"));
}

}  // namespace
}  // namespace emtb
