// Kills emtbd at random instants of a run, again and again, and looks from outside what became of reference and
// session.
//
//     kill_proof [--times N] [--results FILE] [--seconds S] [--safe-within S] [--lost-at-most S] [--seed N] [--nice N]
//
// With --results each kill becomes a line of that file as soon as it is judged, and those that stand there count:
// called again, it goes on until there are N. --seconds ends it earlier, after the kill that is under way.
//
// The plant lives in a process of its own and holds the reference, as a card does. After each kill -9 `emtb-safe`
// runs, as ExecStopPost does under systemd, and with the unit's priority where we may; the plant's log tells when the
// reference was safe. The next daemon repairs the session. Exit 0: all readable, all safe, within the limits.

#include <sys/resource.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "hal/error.h"
#include "server/client.h"
#include "session/spec.h"
#include "session/writer.h"
#include "tests/plant_bench.h"
#include "tests/process.h"

namespace emtb {
namespace {

using nlohmann::json;

constexpr double longest_life = 1.0;  // [s] of a run before it is killed
constexpr double never = 1e9;         // [s]
const char* const profile = "name: doomed\nkind: step\nlevel: 3\nbefore: 0\nhold: 100\nafter: 0\n";

struct Options {
  int times = 10;
  double safe_within = 0.2;    // [s]
  double lost_at_most = 0.25;  // [s]
  double seconds = std::numeric_limits<double>::infinity();
  std::string results{};
  unsigned seed = 1;
  int nice = -10;
};

double monotonic() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// What one run of a daemon came to.
struct Kill {
  std::string outcome;    // `readable`, `unreadable`, or `ended`: by itself, before it could be killed
  double safe_after = 0;  // [s] the reference, after the kill
  double lost = 0;        // [s] of the session, before the kill
};

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
    if (!options_.results.empty()) go_on();
  }
  ~Proof() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  void kill_once() {
    if (!daemon_) launch();
    arm();
    const json started = client_->call("run", {{"profile", profile}});
    std::this_thread::sleep_for(std::chrono::duration<double>(life()));
    const json run = client_->call("status", {})["run"];
    const double asked = monotonic();
    if (run.is_null()) return keep({.outcome = "ended"});  // by a fault, where the machine stalled: nothing to kill
    const double killed = monotonic();
    daemon_->signal(SIGKILL);
    daemon_->wait();
    Process safe({EMTB_SAFE, "--config", folder_ / "bench.yaml"}, folder_ / "safe");
    if (safe.wait() != 0) throw Error(safe.err());
    double at = 0;
    eventually([&] { return (at = safe_since(killed)) > 0; }, 5);
    Kill kill{.outcome = "readable", .safe_after = at > 0 ? at - killed : never};
    daemon_.reset();
    client_.reset();
    launch();  // which repairs the session, when it is in service
    eventually([&] { return !ended_abruptly(started["session"].get<std::string>()); }, 20);
    try {
      const Session session = read_session(started["session"].get<std::string>());
      const auto& runs = session.runs;
      const bool has_rows = !runs.empty() && runs[0].has(Signal::omega) && !runs[0].at(Signal::omega).t.empty();
      const double last = has_rows ? runs[0].at(Signal::omega).t.back() : 0;
      kill.lost = std::max(0.0, run["t"].get<double>() + killed - asked - last);
      std::filesystem::remove(started["session"].get<std::string>());
    } catch (const SessionError& e) {
      std::cerr << e.what() << "\n";
      kill.outcome = "unreadable";
    }
    keep(kill);
  }

  bool report() {
    std::vector<double> safe_after, lost;  // [s]
    std::map<std::string, int> count;
    for (const Kill& kill : kills_) {
      ++count[kill.outcome];
      if (kill.outcome != "ended") safe_after.push_back(kill.safe_after);
      if (kill.outcome == "readable") lost.push_back(kill.lost);
    }
    std::ranges::sort(safe_after);
    std::ranges::sort(lost);
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
    std::printf("%zu kills (%d more runs had ended by themselves), %d sessions unreadable\n", kills(), count["ended"],
                count["unreadable"]);
    const bool safe = print("reference safe after", safe_after, options_.safe_within);
    const bool kept = print("lost of the session", lost, options_.lost_at_most);
    return safe && kept && count["unreadable"] == 0 && kills() > 0;
  }

  /// What the daemon said last, where it is gone without having been killed.
  std::string last_words() const { return daemon_ ? daemon_->err() : std::string(); }

  std::size_t kills() const {
    return static_cast<std::size_t>(std::ranges::count_if(kills_, [](const Kill& k) { return k.outcome != "ended"; }));
  }

 private:
  /// Takes up what the file of results holds: the kills that were, and where their random numbers ended.
  void go_on() {
    std::ifstream in(options_.results);
    std::string line;
    while (std::getline(in, line)) {
      std::istringstream words(line);
      Kill kill;
      if (!(words >> kill.outcome >> kill.safe_after >> kill.lost)) throw Error(options_.results + ": not of ours");
      kills_.push_back(kill);
      life();
    }
  }
  void keep(const Kill& kill) {
    kills_.push_back(kill);
    if (options_.results.empty()) return;
    std::ofstream out(options_.results, std::ios::app);
    out << kill.outcome << " " << kill.safe_after << " " << kill.lost << std::endl;
    if (!out) throw Error(options_.results + ": cannot be written");
  }
  /// [s] of the next run
  double life() { return std::uniform_real_distribution(0.0, longest_life)(random_); }

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
  std::vector<Kill> kills_;
};

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (i + 1 >= argc) throw Error(word + ": wants a value, or is not known");
    if (word == "--results") {
      options.results = argv[++i];
      continue;
    }
    const double value = std::stod(argv[++i]);
    if (word == "--times") {
      options.times = static_cast<int>(value);
    } else if (word == "--safe-within") {
      options.safe_within = value;
    } else if (word == "--lost-at-most") {
      options.lost_at_most = value;
    } else if (word == "--seed") {
      options.seed = static_cast<unsigned>(value);
    } else if (word == "--seconds") {
      options.seconds = value;
    } else if (word == "--nice") {
      options.nice = static_cast<int>(value);
    } else {
      throw Error(word +
                  ": not known. Known: --times, --results, --seconds, --safe-within, --lost-at-most, --seed, --nice");
    }
  }
  return options;
}

}  // namespace
}  // namespace emtb

int main(int argc, char** argv) {
  try {
    const auto options = emtb::parse(argc, argv);
    // Nice=-10 of emtbd.service, which the daemon and the program that makes safe inherit from us. Refused: as it is.
    if (options.nice != 0 && setpriority(PRIO_PROCESS, 0, options.nice) != 0) std::puts("at ordinary priority");
    emtb::Proof proof(options);
    const double end = emtb::monotonic() + options.seconds;
    for (int attempts = 0;
         static_cast<int>(proof.kills()) < options.times && attempts < 3 * options.times && emtb::monotonic() < end;
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
