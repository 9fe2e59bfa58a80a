#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <exception>
#include <thread>

#include "daemon/guardian.h"
#include "daemon/make_safe.h"

namespace emtb {

namespace {

constexpr int silent_at_most = 2'000;  // [ms], as systemd's watchdog
constexpr int after_a_stall = 250;     // [ms] of the whole machine: the daemon comes after it too

enum class Ending { in_order, without_a_word, stood_still };

/// Until the daemon ends, in whatever way. Says nothing: standard error may be what nobody reads.
Ending watch_over(pid_t daemon) {
  bool expecting = false;
  Ending ending = Ending::without_a_word;
  for (;;) {
    pollfd watch{.fd = guardians_watch, .events = POLLIN, .revents = 0};
    int heard = poll(&watch, 1, expecting ? silent_at_most : -1);
    if (heard == 0) heard = poll(&watch, 1, after_a_stall);
    if (heard == 0 && getppid() == daemon) {
      kill(daemon, SIGKILL);
      ending = Ending::stood_still;
      expecting = false;
    }
    if (heard <= 0) continue;
    char said = 0;
    const ssize_t got = read(guardians_watch, &said, 1);
    if (got < 0 && errno == EINTR) continue;
    if (got != 1) return ending;
    if (said == 'q') return Ending::in_order;
    expecting = said == 'a';
  }
}

}  // namespace

int keep_guard(const std::filesystem::path& bench, const char* program) noexcept {
  // It ends when the daemon ends, not when somebody asks the two of them to.
  for (const int ignored : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE}) signal(ignored, SIG_IGN);
  try {
    const BenchConfig config = read_bench(bench);
    const char ready = 'r';
    if (write(guardians_ready, &ready, 1) != 1) return 0;
    close(guardians_ready);
    const Ending ending = watch_over(getppid());
    if (ending == Ending::in_order) return 0;
    constexpr int attempts = 40;  // the dying daemon's devices are let go one after the other
    for (int i = 1; i < attempts; ++i) {
      if (make_safe(config, nullptr) == 0) {
        std::fprintf(stderr, "%s: emtbd %s; the reference is safe\n", program,
                     ending == Ending::stood_still ? "stands still and was ended" : "is gone without a word");
        return 0;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(25));
    }
    return make_safe(config, program);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s: %s\n", program, e.what());
  }
  return 2;
}

}  // namespace emtb
