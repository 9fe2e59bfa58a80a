#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace emtb {

/// Waits until `is_so`, at most `seconds` (generous: the machine may be busy). @return whether it came to be
inline bool eventually(const std::function<bool()>& is_so, double seconds = 60) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < until) {
    if (is_so()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return is_so();
}

/// A program under test, its output in files. Killed when the test forgets it.
class Process {
 public:
  Process(std::vector<std::string> words, const std::filesystem::path& output)
      : out_(output.string() + ".out"), err_(output.string() + ".err") {
    const int out = open(out_.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0600);
    const int err = open(err_.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0600);
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    pid_ = fork();
    if (pid_ == 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);  // a test that crashes leaves no daemon behind
      dup2(out, STDOUT_FILENO);
      dup2(err, STDERR_FILENO);
      execv(argv[0], argv.data());
      _exit(127);
    }
    close(out);
    close(err);
    if (pid_ < 0) throw std::runtime_error("fork");
  }
  ~Process() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  int pid() const { return pid_; }
  void signal(int number) const { ::kill(pid_, number); }
  bool running() { return !collect(WNOHANG); }

  /// The exit code, 128 + n where signal n ended it, -1 where it does not end.
  int wait(double seconds = 60) {
    if (!eventually([this] { return collect(WNOHANG); }, seconds)) return -1;
    return WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
  }

  std::string out() const { return text(out_); }
  std::string err() const { return text(err_); }

 private:
  bool collect(int flags) {
    if (pid_ > 0 && waitpid(pid_, &status_, flags) == pid_) pid_ = 0;
    return pid_ == 0;
  }
  static std::string text(const std::filesystem::path& file) {
    std::ifstream in(file);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  std::filesystem::path out_, err_;
  pid_t pid_ = 0;
  int status_ = 0;
};

}  // namespace emtb
