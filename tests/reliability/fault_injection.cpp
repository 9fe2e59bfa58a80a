// Makes each call of emtbd to the system fail in turn, at each place that calls, and looks what becomes of the bench.
//
//     fault_injection [--cases N] [--jobs N] [--seed N] [--only CALL] [--one CALL:CALLER:WITHIN:N] [--report FILE]
//
// Calls are those of failing_calls.cpp: memory, open, write, flush, rename, accept, send. A first daemon is started,
// armed, run and ended undisturbed, which counts the sites. Then one daemon for each case: a site's first, second and
// late call fails once; of what goes to disk also all calls from the first on. Afterwards the reference must be safe
// (the plant is a process of its own, and holds it), what failed must have a name, each session must be readable, and
// the daemon must be there and answer, or have ended with a line that says why. Where a C library dies of its own call
// (HDF5 does for memory and for one write, and the C library that looks for a group), reference and sessions must be
// well all the same and the guardian must have said so; that is counted by itself. --cases takes an even choice of them
// all; --jobs shares them out over processes, each with a plant of its own: most of a case is waiting.

#include <sys/personality.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "drivers/simulated/plant_port.h"
#include "hal/error.h"
#include "session/spec.h"
#include "session/writer.h"
#include "tests/emtbd.h"
#include "tests/plant_bench.h"

namespace emtb {
namespace {

using nlohmann::json;

constexpr int not_run = 77;  // ctest's SKIP_RETURN_CODE

const char* const profile = "name: short\nkind: step\nlevel: 3\nbefore: 0.02\nhold: 0.1\nafter: 0.03\n";

struct Options {
  std::size_t cases = 1'000'000;
  std::size_t part = 0, jobs = 1;
  unsigned seed = 1;
  std::string only{}, one{};
  std::filesystem::path report{};
};

/// A place that calls, and how often a run passes it.
struct Site {
  std::string call, caller, within;
  std::uint64_t times = 0;
};

/// Of `CALL:CALLER:WITHIN:N`.
Site site_of(const std::string& which) {
  Site site;
  std::istringstream parts(which);
  std::getline(parts, site.call, ':');
  std::getline(parts, site.caller, ':');
  std::getline(parts, site.within, ':');
  return site;
}

/// What one failing call came to.
struct Outcome {
  std::string kind;  // `no harm`, `refused`, `fault`, `connection`, `ended`, `not reached`, or how it fell
  bool survived = true;
  std::string detail{};
};

class Injection {
 public:
  Injection() {
    std::string pattern = std::filesystem::temp_directory_path() / "emtb_inject_XXXXXX";
    if (mkdtemp(pattern.data()) == nullptr) throw Error("no temporary folder");
    folder_ = pattern;
    std::string bench = name_.bench();
    bench.replace(bench.find("rate: 1000"), 10, "rate: 200");  // for a machine that does other things as well
    std::ofstream(folder_ / "bench.yaml") << bench;
    plant_ = std::make_unique<Process>(std::vector<std::string>{EMTB_PLANT, "--config", folder_ / "bench.yaml"},
                                       folder_ / "plant");
    if (!eventually([this] { return plant_->out().find("lives") != std::string::npos; })) throw Error(plant_->err());
    port_ = std::make_unique<simulated::PlantMemory>(simulated::PlantMemory::open(name_.text()));
  }
  ~Injection() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  std::vector<Site> sites() {
    const auto file = folder_ / "calls";
    setenv("EMTB_CALLS", file.c_str(), 1);
    const Outcome outcome = attempt();
    unsetenv("EMTB_CALLS");
    if (outcome.kind != "no harm") throw Error("an undisturbed run comes to: " + outcome.kind + ": " + outcome.detail);
    std::vector<Site> all;
    std::ifstream in(file);
    for (Site site; in >> site.call >> site.caller >> site.within >> site.times;) all.push_back(site);
    if (all.size() < 100) throw Error("no sites were counted: is " EMTB_FAILING_CALLS " loaded?");
    return all;
  }

  Outcome one(const std::string& which) {
    const auto failed = folder_ / "failed";
    std::filesystem::remove(failed);
    const Site site = site_of(which);
    in_library_ = site.caller != site.within;
    setenv("EMTB_FAIL", which.c_str(), 1);
    setenv("EMTB_FAILED", failed.c_str(), 1);
    Outcome outcome = attempt();
    unsetenv("EMTB_FAIL");
    if (outcome.kind == "no harm" && !std::filesystem::exists(failed)) outcome.kind = "not reached";
    return outcome;
  }

 private:
  /// A daemon's whole life: armed, one run, a stop, its end.
  Outcome attempt() {
    std::filesystem::remove_all(folder_ / "data");
    (*port_)->reference = 0;
    setenv("LD_PRELOAD", EMTB_FAILING_CALLS, 1);
    Process emtbd(emtbd_words(folder_ / "bench.yaml", folder_), folder_ / "emtbd");
    unsetenv("LD_PRELOAD");
    told_.clear();
    converse(emtbd);
    Outcome outcome = end_of(emtbd);
    const std::string words = emtbd.err();
    if (outcome.survived && outcome.kind != "no harm" && outcome.kind != "died in a library" && told_.empty() &&
        words.find("emtbd: ") == std::string::npos && words.find(" error: ") == std::string::npos &&
        words.find(" warning: ") == std::string::npos) {
      outcome = {"not named", false};
    }
    if (outcome.survived) read_sessions(outcome);
    outcome.detail += told_ + " | " + words.substr(words.size() - std::min<std::size_t>(words.size(), 400));
    return outcome;
  }

  /// What a person does with a bench; whatever is refused on the way is kept.
  void converse(Process& emtbd) {
    ended_ = nullptr;
    lost_ = false;
    for (int tries = 0; tries < 3; ++tries) {
      try {
        const auto daemon = client_of(emtbd, folder_ / "s");
        if (!daemon) return;
        daemon->call("reset", {});
        daemon->call("subscribe", {{"rate", 20}});
        daemon->call("run", {{"profile", profile}, {"note", "a call fails"}});
        ended_ = end_of_run(*daemon);
        daemon->call("config", {});
        stop_now(folder_ / "s");
        return;
      } catch (const rpc::Refusal& e) {
        told_ += std::string("refused: ") + e.what() + "; ";
      } catch (const std::exception& e) {
        told_ += std::string("lost: ") + e.what() + "; ";
        lost_ = true;
      }
    }
  }

  Outcome end_of(Process& emtbd) {
    const bool alive = emtbd.running();
    if (alive) {
      const auto again = client_of(emtbd, folder_ / "s");
      if (!again && emtbd.running()) return {"does not answer", false};
    }
    if (!eventually([this] { return (*port_)->reference == 0; }, 5)) return {"unsafe", false};
    if (emtbd.running()) emtbd.signal(SIGTERM);
    const int code = emtbd.wait(30);
    if ((*port_)->reference != 0) return {"unsafe at its end", false};
    if (code < 0) return {"does not end", false};
    if (const bool opened = emtbd.err().find("latched until") != std::string::npos; code != 0 && code != 2) {
      return death(emtbd, code, opened);
    }
    if (!alive || code == 2) return {.kind = "ended"};
    if (!ended_.is_null() && ended_.value("outcome", "") == "fault") {
      told_ += ended_.dump();
      return {.kind = "fault"};
    }
    if (lost_) return {.kind = "connection"};
    return {.kind = told_.empty() && !ended_.is_null() ? "no harm" : "refused"};
  }

  /// By its own last resort, or by a library's. Before a bench is open a library may end the process as it likes.
  Outcome death(const Process& emtbd, int code, bool opened) const {
    const auto said = [&](const char* words) { return emtbd.err().find(words) != std::string::npos; };
    if (said("where nothing could take it")) return {.kind = "ended by its last resort"};
    if (in_library_ && (!opened || eventually([&] { return said("emtbd is gone without a word"); }, 5))) {
      return {.kind = "died in a library"};
    }
    return {"died", false, "exit " + std::to_string(code) + "; "};
  }

  void read_sessions(Outcome& outcome) const {
    if (!std::filesystem::exists(folder_ / "data")) return;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / "data")) {
      const auto& file = entry.path();
      if (file.extension() != ".h5") continue;
      try {
        if (ended_abruptly(file)) {
          Process repair({EMTBD, "--repair", file}, folder_ / "repair");
          repair.wait();
        }
        read_session(file);
      } catch (const SessionError& e) {
        outcome = {"unreadable session", false, std::string(e.what()) + "; "};
      }
    }
  }

  PlantName name_;
  std::filesystem::path folder_;
  std::unique_ptr<Process> plant_;
  std::unique_ptr<simulated::PlantMemory> port_;
  json ended_;
  bool lost_ = false;
  bool in_library_ = false;  // the call that fails is one of HDF5's, say
  std::string told_;
};

/// First, second and late; of what leaves the process all from the first on, too: a full disk stays full.
std::vector<std::string> cases_of(const std::vector<Site>& sites, const std::string& only) {
  std::vector<std::string> all;
  for (const Site& site : sites) {
    if (!only.empty() && site.call != only) continue;
    const std::string where = site.call + ":" + site.caller + ":" + site.within + ":";
    all.push_back(where + "1");
    if (site.times >= 2) all.push_back(where + "2");
    if (site.times >= 4) all.push_back(where + std::to_string(site.times * 9 / 10));
    for (const char* lasting : {"open", "write", "pwrite", "writev", "sync", "truncate", "rename", "pipe"}) {
      if (site.call == lasting) all.push_back(where + "1+");
    }
  }
  return all;
}

/// Where in emtbd a case is, for a person.
std::string place(const std::string& which) {
  const std::string within = site_of(which).within;
  const unsigned long offset = std::stoul(within, nullptr, 16) - 0x555555554000;  // where Linux puts a PIE
  char command[512];
  std::snprintf(command, sizeof command, "addr2line -C -f -e %s 0x%lx", EMTBD, offset - 1);
  std::string name = "?";
  if (std::FILE* pipe = popen(command, "r")) {
    char line[400];
    if (std::fgets(line, sizeof line, pipe) != nullptr) name = std::string(line, std::strcspn(line, "\n"));
    pclose(pipe);
  }
  return name;
}

int one(const std::string& which) {
  const Outcome outcome = Injection().one(which);
  std::cout << place(which) << ": " << outcome.kind << ": " << outcome.detail << "\n";
  return outcome.survived ? 0 : 1;
}

/// Each `jobs`-th case from `part` on.
int some(const Options& options, const std::vector<std::string>& cases) {
  Injection injection;
  std::map<std::string, int> count;
  int fell = 0;
  std::ofstream report;
  if (!options.report.empty()) report.open(options.report, std::ios::app);
  std::ostringstream told;
  for (std::size_t n = options.part; n < cases.size(); n += options.jobs) {
    const Outcome outcome = injection.one(cases[n]);
    ++count[outcome.kind];
    report << cases[n] + " " + outcome.kind + " " + place(cases[n]) + "\n" << std::flush;
    if (outcome.survived) continue;
    ++fell;
    told << cases[n] << " in " << place(cases[n]) << ": " << outcome.kind << ": " << outcome.detail << "\n";
  }
  told << "of every " << options.jobs << (options.jobs == 1 ? "st" : "th") << " case:";
  for (const auto& [kind, times] : count) told << " " << kind << " " << times << ";";
  std::cout << told.str() + "\n" << std::flush;
  return fell == 0 ? 0 : 1;
}

int run(Options options) {
  if (!options.one.empty()) return one(options.one);
  const std::vector<Site> sites = Injection().sites();
  std::vector<std::string> cases = cases_of(sites, options.only);
  std::ranges::shuffle(cases, std::mt19937(options.seed));
  std::cout << sites.size() << " sites, " << cases.size() << " cases" << std::endl;
  cases.resize(std::min(cases.size(), options.cases));
  std::vector<pid_t> children;
  for (; options.part < options.jobs; ++options.part) {
    const pid_t child = fork();
    if (child < 0) throw Error("no process: fork() is refused");
    if (child == 0) std::exit(some(options, cases));
    children.push_back(child);
  }
  int worst = 0;
  for (const pid_t child : children) {
    int status = 0;
    waitpid(child, &status, 0);
    worst = std::max(worst, WIFEXITED(status) ? WEXITSTATUS(status) : 2);
  }
  return worst;
}

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (i + 1 >= argc) throw Error(word + ": wants a value, or is not known");
    const std::string value = argv[++i];
    if (word == "--cases") {
      options.cases = std::stoul(value);
    } else if (word == "--jobs") {
      options.jobs = std::max(std::stoul(value), 1UL);
    } else if (word == "--seed") {
      options.seed = static_cast<unsigned>(std::stoul(value));
    } else if (word == "--only") {
      options.only = value;
    } else if (word == "--one") {
      options.one = value;
    } else if (word == "--report") {
      options.report = value;
    } else {
      throw Error(word + ": not known. Known: --cases, --jobs, --seed, --only, --one, --report");
    }
  }
  return options;
}

}  // namespace
}  // namespace emtb

int main(int argc, char** argv) {
  try {
    const auto options = emtb::parse(argc, argv);
    if (personality(ADDR_NO_RANDOMIZE) < 0) {
      std::cerr << "fault_injection: not run: addresses stay random, since personality() is refused here\n";
      return emtb::not_run;
    }
    return emtb::run(options);
  } catch (const std::exception& e) {
    std::cerr << "fault_injection: " << e.what() << "\n";
    return 2;
  }
}
