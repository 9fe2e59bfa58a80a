#include "daemon/guardian.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string>
#include <utility>

namespace emtb {
namespace {

constexpr int ready_within = 5'000;  // [ms] of a busy machine

/// Two pipes: by `watch` the guardian sees our end, by `ready` it says that it is on guard.
struct Ends {
  std::array<int, 2> watch{-1, -1}, ready{-1, -1};

  /// The guardian's ends get numbers above those that they have there.
  bool open() {
    if (pipe2(watch.data(), O_CLOEXEC) != 0 || pipe2(ready.data(), O_CLOEXEC) != 0) return false;
    fcntl(watch[1], F_SETFL, O_NONBLOCK);
    for (int* end : {&watch[0], &ready[1]}) {
      const int other = fcntl(*end, F_DUPFD_CLOEXEC, guardians_ready + 1);
      close(*end);
      *end = other;
    }
    return watch[0] >= 0 && ready[1] >= 0;
  }
  static void end(int& file) {
    if (file >= 0) close(file);
    file = -1;
  }
  ~Ends() {
    for (int* file : {&watch[0], &watch[1], &ready[0], &ready[1]}) end(*file);
  }
};

/// In a session of its own: what is sent to the daemon's terminal is not meant for it.
pid_t spawn(const std::filesystem::path& program, const std::filesystem::path& bench, const Ends& ends) {
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSID);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, ends.watch[0], guardians_watch);
  posix_spawn_file_actions_adddup2(&files, ends.ready[1], guardians_ready);
  std::array<std::string, 4> words{program.string(), "--config", bench.string(), "--guard"};
  std::array<char*, 5> argv{};
  for (std::size_t i = 0; i < words.size(); ++i) argv[i] = words[i].data();
  pid_t process = 0;
  const int error = posix_spawn(&process, argv[0], &files, &attributes, argv.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  return error == 0 ? process : 0;
}

}  // namespace

bool Guardian::start() {
  dismiss();
  Ends ends;
  if (!ends.open()) return false;
  process_ = spawn(program_, bench_, ends);
  Ends::end(ends.ready[1]);  // so that its death would be the end of what we wait for
  watch_ = std::exchange(ends.watch[1], -1);
  pollfd said{.fd = ends.ready[0], .events = POLLIN, .revents = 0};
  char ready = 0;
  if (process_ > 0 && poll(&said, 1, ready_within) > 0 && read(ends.ready[0], &ready, 1) == 1) return true;
  dismiss();
  return false;
}

bool Guardian::has_died() {
  if (process_ <= 0 || waitpid(process_, nullptr, WNOHANG) != process_) return false;
  process_ = 0;
  return true;
}

void Guardian::tell(char what) {
  // A dead one's pipe refuses it (SIGPIPE is ignored), and a stopped one's is full some day: neither may keep us.
  if (watch_ >= 0) [[maybe_unused]]
    const ssize_t n = write(watch_, &what, 1);
}

void Guardian::dismiss() {
  // Whoever has stopped it keeps us from ending. Before it ends, for a sanitizer that looks for leaks then stops it.
  if (process_ > 0) kill(process_, SIGCONT);
  tell('q');
  if (watch_ >= 0) close(watch_);
  watch_ = -1;
  if (process_ > 0) {
    while (waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  process_ = 0;
}

}  // namespace emtb
