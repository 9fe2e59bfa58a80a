#include "daemon/repairs.h"

#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <exception>
#include <string>
#include <vector>

#include "session/writer.h"

namespace emtb {
namespace {

constexpr double least_time = 60;        // [s]; bounds its processor time itself, this is for a disk that hangs
constexpr double slowest = 1024 * 1024;  // [byte/s]

double seconds_for(const std::filesystem::path& file) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  return least_time + (error ? 0 : static_cast<double>(size) / slowest);
}

/// @return its process id; 0 where none can be had
pid_t start(const std::filesystem::path& program, const std::filesystem::path& file) {
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  std::string name = program.string(), what = "--repair", which = file.string();
  char* const words[] = {name.data(), what.data(), which.data(), nullptr};
  pid_t child = 0;
  const int error = posix_spawn(&child, name.c_str(), nullptr, &attributes, words, environ);
  posix_spawnattr_destroy(&attributes);
  return error == 0 ? child : 0;
}

}  // namespace

Repairs::Repairs(std::filesystem::path folder, std::filesystem::path program,
                 std::function<void(const std::string&)> log)
    : folder_(std::move(folder)), program_(std::move(program)), log_(std::move(log)), thread_([this] { work(); }) {}

Repairs::~Repairs() {
  quit_ = true;
  thread_.join();
}

void Repairs::work() {
  try {
    repair_all();
  } catch (const std::exception& e) {  // no memory: the bench is in service all the same
    log_(std::string("sessions that ended abruptly are not repaired: ") + e.what());
  }
}

void Repairs::repair_all() const {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (std::filesystem::directory_iterator at(folder_, error), end; !error && at != end; at.increment(error)) {
    if (at->path().extension() == ".h5") files.push_back(at->path());
  }
  std::ranges::sort(files);
  for (const auto& file : files) {
    if (quit_) return;
    if (ended_abruptly(file)) repair(file);
  }
}

void Repairs::repair(const std::filesystem::path& file) const {
  const pid_t child = start(program_, file);
  if (child == 0) return log_(file.string() + ": no process is left to repair it with");
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds_for(file));
  int status = 0;
  bool stalled = false;
  while (waitpid(child, &status, WNOHANG) == 0) {
    stalled = stalled || std::chrono::steady_clock::now() > until;
    if (stalled || quit_) kill(child, SIGKILL);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  if (quit_) return;
  if (WIFEXITED(status)) {  // it has said why, where it could not
    if (WEXITSTATUS(status) == 0) log_(file.string() + ": its recording had ended abruptly; repaired");
    return;
  }
  std::error_code error;
  std::filesystem::path aside = file;
  aside += ".unreadable";
  std::filesystem::rename(file, aside, error);
  log_(file.string() + ": " + (stalled ? "repairing it does not end" : "repairing it fails") + " (SIG" +
       sigabbrev_np(WTERMSIG(status)) + ")" +
       (error ? "; and it cannot be renamed: " + error.message() : "; it is " + aside.string() + " now"));
}

}  // namespace emtb
