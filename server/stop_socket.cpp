#include "server/stop_socket.h"

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cinttypes>
#include <cstdio>
#include <limits>

#include "hal/error.h"

namespace emtb {
namespace {

/// A table of descriptors of this thread's own, with these two in it and nothing else. Where the system forbids that,
/// it goes on with everybody's.
void own_descriptors(int a, int b) {
  if (unshare(CLONE_FILES) != 0) return;
  const auto low = static_cast<unsigned>(std::min(a, b)), high = static_cast<unsigned>(std::max(a, b));
  const auto close_all = [](unsigned from, unsigned to) {
    if (from <= to) close_range(from, to, 0);
  };
  if (low > 0) close_all(0, low - 1);
  close_all(low + 1, high - 1);
  close_all(high + 1, std::numeric_limits<int>::max());
}

void answer(int client, const Stopped& stopped) {
  std::array<char, 160> line{};
  std::array<char, 24> run{"null"};
  if (stopped.run != 0) std::snprintf(run.data(), run.size(), "%" PRIu64, stopped.run);
  const int size = std::snprintf(line.data(), line.size(), "{\"stopped\": %s, \"reference_safe\": %s}\n", run.data(),
                                 stopped.safe ? "true" : "false");
  send(client, line.data(), static_cast<std::size_t>(size), MSG_NOSIGNAL | MSG_DONTWAIT);
}

}  // namespace

std::filesystem::path stop_path(const std::filesystem::path& socket) { return socket.string() + ".stop"; }

StopSocket::StopSocket(const std::filesystem::path& path)
    : listening_(path), wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (wake_ < 0) throw ProtocolError(path.string() + ": no descriptor is left for it");
}

StopSocket::~StopSocket() {
  stop();
  close(wake_);
}

void StopSocket::start(Handlers handlers) {
  handlers_ = std::move(handlers);
  thread_ = std::thread([this] { work(); });
}

void StopSocket::stop() {
  if (!thread_.joinable()) return;
  ending_ = true;
  const std::uint64_t one = 1;  // so that it looks at once, not at its next turn
  [[maybe_unused]] const ssize_t n = write(wake_, &one, sizeof one);
  thread_.join();
}

void StopSocket::work() {
  constexpr int turn = 1000;  // [ms]
  own_descriptors(listening_.descriptor(), wake_);
  while (!ending_) {
    std::array<pollfd, 2> ready{pollfd{.fd = listening_.descriptor(), .events = POLLIN, .revents = 0},
                                pollfd{.fd = wake_, .events = POLLIN, .revents = 0}};
    if (poll(ready.data(), ready.size(), turn) < 0 && errno != EINTR) return;
    if (ready[0].revents != 0) serve();
  }
}

/// Somebody has connected. The bench is stopped also where he cannot be let in.
void StopSocket::serve() {
  std::array<int, at_once> callers{};
  std::size_t count = 0;
  while (count < at_once) {
    const int caller = accept4(listening_.descriptor(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (caller < 0) break;
    callers[count++] = caller;
  }
  const Stopped stopped = ask();
  for (std::size_t i = 0; i < count; ++i) {
    answer(callers[i], stopped);
    close(callers[i]);
  }
  if (count == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));  // he waits yet, or has gone
}

Stopped StopSocket::ask() const {
  const std::uint64_t number = handlers_.stop();
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(patience);
  while (std::chrono::steady_clock::now() < until) {
    if (const auto done = handlers_.stopped(number)) return *done;
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  return {};
}

}  // namespace emtb
