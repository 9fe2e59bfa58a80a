#include "daemon/guardian.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string>

namespace emtb {
namespace {

constexpr int ready_within = 5'000;  // [ms] of a busy machine

/// Of another process group and session: what is sent to the daemon's terminal is not meant for it.
pid_t spawn(const std::filesystem::path& program, const std::filesystem::path& bench, int socket) {
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSID);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  constexpr int guards = 3;  // the descriptor's number there
  posix_spawn_file_actions_adddup2(&files, socket, guards);
  std::array<std::string, 5> words{program.string(), "--config", bench.string(), "--guard", std::to_string(guards)};
  std::array<char*, 6> argv{};
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
  std::array<int, 2> ends{-1, -1};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) return false;
  if (ends[1] == 3) {  // dup2() onto itself would leave it to be closed by exec
    const int other = fcntl(ends[1], F_DUPFD_CLOEXEC, 4);
    close(ends[1]);
    ends[1] = other;
  }
  process_ = spawn(program_, bench_, ends[1]);
  close(ends[1]);
  socket_ = ends[0];
  pollfd said{.fd = socket_, .events = POLLIN, .revents = 0};
  char ready = 0;
  if (process_ > 0 && poll(&said, 1, ready_within) > 0 && recv(socket_, &ready, 1, 0) == 1) return true;
  dismiss();
  return false;
}

bool Guardian::has_died() {
  if (process_ <= 0 || waitpid(process_, nullptr, WNOHANG) != process_) return false;
  process_ = 0;
  return true;
}

void Guardian::dismiss() {
  if (socket_ >= 0) {
    const char bye = 'q';
    send(socket_, &bye, 1, MSG_NOSIGNAL | MSG_DONTWAIT);
    close(socket_);
  }
  socket_ = -1;
  if (process_ > 0) {
    kill(process_, SIGCONT);  // whoever has stopped it keeps us from ending
    while (waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  process_ = 0;
}

}  // namespace emtb
