#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <thread>

#include "hal/error.h"
#include "server/client.h"
#include "session/spec.h"
#include "tools/bench_run.h"
#include "tools/commands.h"
#include "tools/result_json.h"

namespace emtb {
namespace {

using nlohmann::json;

struct ReplayOptions {
  std::string session;
  std::string bench;
  std::string pace = "max";
  std::string data = "sessions";
  std::string json_file;
};

/// A folder of this process's own, gone with it.
class Workroom {
 public:
  Workroom() {
    std::string pattern = std::filesystem::temp_directory_path() / "emtb-replay-XXXXXX";
    if (mkdtemp(pattern.data()) == nullptr) throw Error(pattern + ": no temporary folder");
    path = pattern;
  }
  ~Workroom() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  Workroom(const Workroom&) = delete;
  Workroom& operator=(const Workroom&) = delete;

  std::filesystem::path path;
};

/// emtbd, from beside this program; it ends with us.
class DaemonOfOurs {
 public:
  DaemonOfOurs(std::vector<std::string> words, std::filesystem::path log) : log_(std::move(log)) {
    const int file = open(log_.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600);
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    pid_ = fork();
    if (pid_ == 0) {
      prctl(PR_SET_PDEATHSIG, SIGTERM);
      dup2(file, STDERR_FILENO);
      execv(argv[0], argv.data());
      _exit(127);
    }
    close(file);
    if (pid_ < 0) throw Error("emtbd cannot be started");
  }
  ~DaemonOfOurs() {
    if (!running()) return;
    kill(pid_, SIGTERM);
    waitpid(pid_, nullptr, 0);
  }
  DaemonOfOurs(const DaemonOfOurs&) = delete;
  DaemonOfOurs& operator=(const DaemonOfOurs&) = delete;

  bool running() {
    if (pid_ > 0 && waitpid(pid_, nullptr, WNOHANG) == pid_) pid_ = 0;
    return pid_ > 0;
  }

  /// Why it is gone: the last it said, without its name.
  std::string last_words() const {
    std::ifstream in(log_);
    std::string line, last = "emtbd is not there, or ended without a word";
    while (std::getline(in, line)) last = line;
    return last.starts_with("emtbd: ") ? last.substr(7) : last;
  }

 private:
  std::filesystem::path log_;
  pid_t pid_ = 0;
};

/// The bench that judges: the one that was named, else the one that the session was recorded on.
std::string bench_of(const ReplayOptions& options, const Workroom& room) {
  if (!options.bench.empty()) return options.bench;
  const std::string text = read_session(parse_session_spec(options.session).path).config;
  if (text.empty()) {
    throw Error(options.session + ": does not hold the bench it was recorded on. Name one with --config BENCH.yaml");
  }
  const auto file = room.path / "bench.yaml";
  std::ofstream(file) << text;
  return file;
}

std::unique_ptr<Client> connect(DaemonOfOurs& daemon, const std::filesystem::path& socket) {
  while (daemon.running()) {
    try {
      return std::make_unique<Client>(socket);
    } catch (const ProtocolError&) {  // not yet
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
  throw Error(daemon.last_words());
}

int replay(const ReplayOptions& options) {
  const Workroom room;
  const auto program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "emtbd";
  DaemonOfOurs emtbd({program, "--config", bench_of(options, room), "--socket", room.path / "s", "--data", options.data,
                      "--replay", options.session, "--pace", options.pace},
                     room.path / "log");
  const auto daemon = connect(emtbd, room.path / "s");
  daemon->call("subscribe", {{"rate", 10}});
  daemon->call("reset", json::object());
  catch_interrupt();
  const json ended = run_on_bench(*daemon, {{"profile", "replay"}});
  write_json(options.json_file, ended);
  std::cout << ended["session"].get<std::string>() << std::endl;
  if (ended["outcome"] == "done") return 0;
  std::cerr << "emtb: the replay ended at " << ended["t"].dump()
            << " s: " << (ended["fault"].is_null() ? "stopped" : ended["fault"]["text"].get<std::string>()) << "\n";
  return 1;
}

}  // namespace

void add_replay_command(CommandLine& line) {
  const auto options = std::make_shared<ReplayOptions>();
  line.command("replay",
               "plays a recorded session to the daemon's loop, with no device, and prints where the new session is")
      .argument("SESSION", options->session, "PATH[#RUN] of .h5 or .csv")
      .option("--config", options->bench, "the bench whose limits judge it [the one it was recorded on]")
      .option("--pace", options->pace, "N times real time, or max [max]")
      .option("--data", options->data, "where the new session goes [./sessions]")
      .option("--json", options->json_file, "writes how it ended to this file; - for standard output")
      .action([options] { return replay(*options); });
}

}  // namespace emtb
