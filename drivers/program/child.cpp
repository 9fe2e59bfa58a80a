#include "drivers/program/child.h"

#include <fcntl.h>
#include <grp.h>
#include <pwd.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

#include "drivers/program/confinement.h"
#include "hal/error.h"

namespace emtb::program {
namespace {

constexpr std::array folders{"/usr/local/bin", "/usr/bin", "/bin"};

/// Three pipes; ours, and its.
struct Pipes {
  std::array<std::array<int, 2>, 3> ends{{{-1, -1}, {-1, -1}, {-1, -1}}};

  Pipes() {
    for (auto& pipe : ends) {
      if (pipe2(pipe.data(), O_CLOEXEC) != 0) throw DeviceError(std::string("no pipe: ") + std::strerror(errno));
      for (int& end : pipe) {  // above 2, so that none overwrites another in the child
        if (end > 2) continue;
        const int other = fcntl(end, F_DUPFD_CLOEXEC, 3);
        close(end);
        end = other;
      }
    }
  }
  ~Pipes() {
    for (const auto& pipe : ends) {
      for (const int end : pipe) {
        if (end >= 0) close(end);
      }
    }
  }
  int its(std::size_t file) const { return ends[file][file == 0 ? 0 : 1]; }
  /// Ours from here on, and never waited for.
  int take(std::size_t file) {
    int& end = ends[file][file == 0 ? 1 : 0];
    fcntl(end, F_SETFL, O_NONBLOCK);
    return std::exchange(end, -1);
  }
};

Identity identity_of(const std::string& user) {
  const passwd* entry = getpwnam(user.c_str());
  if (entry == nullptr) throw DeviceError("there is no user " + user);
  Identity identity{.user = entry->pw_uid, .group = entry->pw_gid, .groups = {}};
  int count = 0;
  getgrouplist(user.c_str(), identity.group, nullptr, &count);
  identity.groups.resize(static_cast<std::size_t>(count));
  getgrouplist(user.c_str(), identity.group, identity.groups.data(), &count);
  identity.groups.resize(static_cast<std::size_t>(count));
  return identity;
}

std::vector<char*> pointers(std::vector<std::string>& words) {
  std::vector<char*> all;
  for (std::string& word : words) all.push_back(word.data());
  all.push_back(nullptr);
  return all;
}

/// The child shares our memory until it is its program: no copy of the locked pages, which would keep the loop waiting.
[[gnu::noinline]] pid_t start(Confinement& confinement) {
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  const pid_t pid = vfork();
  if (pid == 0) {
    become(confinement);
    _exit(127);
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return pid;
}

std::string in_words(int status) {
  if (WIFSIGNALED(status)) return std::string("it was ended by SIG") + sigabbrev_np(WTERMSIG(status));
  return "it ended with code " + std::to_string(WEXITSTATUS(status));
}

}  // namespace

std::string find_program(const std::string& name, const std::string& folder) {
  const auto executable = [](const std::string& path) { return access(path.c_str(), X_OK) == 0; };
  if (name.find('/') != std::string::npos) {
    const std::string path = name.starts_with('/') ? name : folder + "/" + name;
    return executable(path) ? path : "";
  }
  for (const char* where : folders) {
    if (const std::string path = std::string(where) + "/" + name; executable(path)) return path;
  }
  return "";
}

Child::Child(const ChildSettings& settings) {
  Pipes pipes;
  std::vector<std::string> words = settings.command;
  std::vector<std::string> surroundings{"PATH=/usr/local/bin:/usr/bin:/bin", "LANG=C.UTF-8", "HOME=/",
                                        "PYTHONUNBUFFERED=1"};  // a line that is said is a line that is sent
  const std::vector<char*> argv = pointers(words), environment = pointers(surroundings);
  Identity identity;
  if (!settings.user.empty()) identity = identity_of(settings.user);
  Confinement confinement{.ends = {pipes.its(0), pipes.its(1), pipes.its(2)},
                          .parent = getpid(),
                          .folder = settings.folder.c_str(),
                          .words = argv.data(),
                          .surroundings = environment.data(),
                          .identity = settings.user.empty() ? nullptr : &identity};
  pid_ = start(confinement);
  if (pid_ < 0) {
    pid_ = 0;
    throw DeviceError(std::string("no process for it: ") + std::strerror(errno));
  }
  if (confinement.step != nullptr) {
    waitpid(pid_, nullptr, 0);
    throw DeviceError(settings.command[0] + ": cannot be started, at " + confinement.step + ": " +
                      std::strerror(confinement.error));
  }
  in_ = pipes.take(0);
  out_ = pipes.take(1);
  err_ = pipes.take(2);
}

bool Child::say(std::string_view line) noexcept {
  return in_ >= 0 && ::write(in_, line.data(), line.size()) == static_cast<ssize_t>(line.size());
}

void Child::hang_up() noexcept {
  if (in_ >= 0) close(in_);
  in_ = -1;
}

std::optional<std::string> Child::ended(double within) noexcept {
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(within);
  while (pid_ > 0) {
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) == pid_) {
      pid_ = 0;
      how_ = in_words(status);
    } else if (std::chrono::steady_clock::now() >= until) {
      return std::nullopt;
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  return how_;
}

void Child::kill() noexcept {
  constexpr double patience = 1;  // [s] for one that a device driver holds in the kernel; it is gone with that
  hang_up();
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    ended(patience);
  }
  for (int* file : {&out_, &err_}) {
    if (*file >= 0) close(*file);
    *file = -1;
  }
}

}  // namespace emtb::program
