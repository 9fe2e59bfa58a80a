// Kills emtbd at random instants of a run, again and again, and looks from outside what became of reference and
// session.
//
//     kill_proof [--times N] [--safe-within S] [--lost-at-most S] [--seed N]
//
// The plant lives in a process of its own and holds the reference, as a card does. After each kill -9 `emtbd --safe`
// runs, as ExecStopPost does under systemd; the plant's log tells when the reference was safe. The next daemon repairs
// the session. Exit 0: all readable, all safe, within the limits.

#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "hal/error.h"
#include "server/client.h"
#include "session/spec.h"
#include "tests/plant_bench.h"
#include "tests/process.h"

namespace emtb {
namespace {

using nlohmann::json;

constexpr double longest_life = 1.0;  // [s] of a run before it is killed
const char* const profile = "name: doomed\nkind: step\nlevel: 3\nbefore: 0\nhold: 100\nafter: 0\n";

struct Options {
  int times = 10;
  double safe_within = 0.2;    // [s]
  double lost_at_most = 0.25;  // [s]
  unsigned seed = 1;
};

double monotonic() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

class Proof {
 public:
  explicit Proof(const Options& options) : options_(options), random_(options.seed) {
    std::string pattern = std::filesystem::temp_directory_path() / "emtb_kill_XXXXXX";
    if (mkdtemp(pattern.data()) == nullptr) throw Error("no temporary folder");
    folder_ = pattern;
    std::ofstream(folder_ / "bench.yaml") << name_.bench();
    plant_ = std::make_unique<Process>(
        std::vector<std::string>{EMTB_PLANT, "--config", folder_ / "bench.yaml", "--log", folder_ / "reference.csv"},
        folder_ / "plant");
    if (!eventually([this] { return plant_->out().find("lives") != std::string::npos; })) throw Error(plant_->err());
  }
  ~Proof() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  void kill_once() {
    if (!daemon_) launch();
    arm();
    const json started = client_->call("run", {{"profile", profile}});
    std::this_thread::sleep_for(
        std::chrono::duration<double>(std::uniform_real_distribution(0.0, longest_life)(random_)));
    const json run = client_->call("status", {})["run"];
    const double asked = monotonic();
    if (run.is_null()) {  // a machine that stalled ended the run by a fault: nothing to kill
      ++ended_before_;
      return;
    }
    const double killed = monotonic();
    daemon_->signal(SIGKILL);
    daemon_->wait();
    Process safe({EMTBD, "--config", folder_ / "bench.yaml", "--safe"}, folder_ / "safe");
    if (safe.wait() != 0) throw Error(safe.err());
    double at = 0;
    eventually([&] { return (at = safe_since(killed)) > 0; }, 5);
    safe_after_.push_back(at > 0 ? at - killed : std::numeric_limits<double>::infinity());
    daemon_.reset();
    client_.reset();
    launch();  // which repairs the session
    try {
      const Session session = read_session(started["session"].get<std::string>());
      const auto& runs = session.runs;
      const bool has_rows = !runs.empty() && runs[0].has(Signal::omega) && !runs[0].at(Signal::omega).t.empty();
      const double last = has_rows ? runs[0].at(Signal::omega).t.back() : 0;
      lost_.push_back(std::max(0.0, run["t"].get<double>() + killed - asked - last));
      std::filesystem::remove(started["session"].get<std::string>());
    } catch (const SessionError& e) {
      std::cerr << e.what() << "\n";
      ++unreadable_;
    }
  }

  bool report() {
    std::ranges::sort(safe_after_);
    std::ranges::sort(lost_);
    const auto at = [](const std::vector<double>& sorted, double share) {
      if (sorted.empty()) return 0.0;
      return 1e3 * sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
    };
    const auto print = [&](const char* what, const std::vector<double>& sorted, double limit) {
      const auto within = std::ranges::count_if(sorted, [&](double x) { return x <= limit; });
      std::printf("%s: median %.0f ms, 99 %% %.0f ms, at most %.0f ms; %td of %zu within %.0f ms\n", what,
                  at(sorted, 0.5), at(sorted, 0.99), at(sorted, 1), within, sorted.size(), 1e3 * limit);
      return static_cast<std::size_t>(within) == sorted.size();
    };
    std::printf("%zu kills (%d more runs had ended by themselves), %d sessions unreadable\n", safe_after_.size(),
                ended_before_, unreadable_);
    const bool safe = print("reference safe after", safe_after_, options_.safe_within);
    const bool kept = print("lost of the session", lost_, options_.lost_at_most);
    return safe && kept && unreadable_ == 0 && !safe_after_.empty();
  }

  /// What the daemon said last, where it is gone without having been killed.
  std::string last_words() const { return daemon_ ? daemon_->err() : std::string(); }

  std::size_t kills() const { return safe_after_.size(); }

 private:
  void launch() {
    daemon_ = std::make_unique<Process>(std::vector<std::string>{EMTBD, "--config", folder_ / "bench.yaml", "--socket",
                                                                 folder_ / "s", "--data", folder_ / "data"},
                                        folder_ / "emtbd");
    const bool answers = eventually([this] {
      try {
        client_ = std::make_unique<Client>(folder_ / "s");
        client_->call("status", {});
        return true;
      } catch (const ProtocolError&) {
        return false;
      }
    });
    if (!answers) throw Error("emtbd does not answer: " + daemon_->err());
  }

  void arm() {
    const bool armed = eventually([this] {  // where the machine stalls, more than once
      try {
        client_->call("reset", {});
        return true;
      } catch (const rpc::Refusal&) {
        return false;
      }
    });
    if (!armed) throw Error("the bench is not armed: " + daemon_->err());
  }

  /// [s] when the plant saw the reference safe after `t` and it stayed so; 0: not yet.
  double safe_since(double t) const {
    std::ifstream log(folder_ / "reference.csv");
    std::string line;
    double since = 0, before = 0;
    while (std::getline(log, line)) {
      double at = 0, volts = 0;
      if (std::sscanf(line.c_str(), "%lf,%lf", &at, &volts) != 2) continue;
      if (at <= t) before = volts;
      if (at > t) since = volts == 0 ? (since > 0 ? since : at) : 0;
    }
    return since == 0 && before == 0 ? t : since;  // it was safe already: the run had not moved it yet
  }

  Options options_;
  std::mt19937 random_;
  PlantName name_;
  std::filesystem::path folder_;
  std::unique_ptr<Process> plant_;
  std::unique_ptr<Process> daemon_;
  std::unique_ptr<Client> client_;
  std::vector<double> safe_after_, lost_;  // [s]
  int unreadable_ = 0;
  int ended_before_ = 0;
};

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (i + 1 >= argc) throw Error(word + ": wants a value, or is not known");
    const double value = std::stod(argv[++i]);
    if (word == "--times") {
      options.times = static_cast<int>(value);
    } else if (word == "--safe-within") {
      options.safe_within = value;
    } else if (word == "--lost-at-most") {
      options.lost_at_most = value;
    } else if (word == "--seed") {
      options.seed = static_cast<unsigned>(value);
    } else {
      throw Error(word + ": not known. Known: --times, --safe-within, --lost-at-most, --seed");
    }
  }
  return options;
}

}  // namespace
}  // namespace emtb

int main(int argc, char** argv) {
  try {
    const auto options = emtb::parse(argc, argv);
    emtb::Proof proof(options);
    for (int attempts = 0; static_cast<int>(proof.kills()) < options.times && attempts < 3 * options.times;
         ++attempts) {
      try {
        proof.kill_once();
      } catch (const emtb::ProtocolError& e) {
        throw emtb::Error(std::string(e.what()) + "; it said:\n" + proof.last_words());
      }
    }
    return proof.report() ? 0 : 1;
  } catch (const std::exception& e) {
    std::cerr << "kill_proof: " << e.what() << "\n";
    return 2;
  }
}
