#include "tools/own_daemon.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "hal/error.h"

namespace emtb {

OwnDaemon::OwnDaemon() {
  std::string pattern = std::filesystem::temp_directory_path() / "emtb-XXXXXX";
  if (mkdtemp(pattern.data()) == nullptr) throw Error(pattern + ": no temporary folder");
  folder_ = pattern;
}

OwnDaemon::~OwnDaemon() {
  if (running()) {
    kill(pid_, SIGTERM);
    waitpid(pid_, nullptr, 0);
  }
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::unique_ptr<Client> OwnDaemon::start(const std::filesystem::path& config, const std::filesystem::path& data,
                                         const std::vector<std::string>& more) {
  const auto program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "emtbd";
  const auto socket = folder_ / "s";
  std::vector<std::string> words{program, "--config", config, "--socket", socket, "--data", data};
  words.insert(words.end(), more.begin(), more.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const int log = open((folder_ / "log").c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600);
  pid_ = fork();
  if (pid_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    dup2(log, STDERR_FILENO);
    execv(argv[0], argv.data());
    _exit(127);
  }
  close(log);
  if (pid_ < 0) throw Error(program.string() + ": cannot be started");

  while (running()) {
    try {
      auto client = std::make_unique<Client>(socket);
      client->call("status", nlohmann::json::object());
      return client;
    } catch (const ProtocolError&) {  // not yet
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
  throw Error(last_words());
}

bool OwnDaemon::running() {
  if (pid_ > 0 && waitpid(pid_, nullptr, WNOHANG) == pid_) pid_ = 0;
  return pid_ > 0;
}

/// Why it is gone, without its name.
std::string OwnDaemon::last_words() const {
  std::ifstream in(folder_ / "log");
  std::string line, last = "emtbd is not there, or ended without a word";
  while (std::getline(in, line)) last = line;
  return last.starts_with("emtbd: ") ? last.substr(7) : last;
}

}  // namespace emtb
