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

int keep_guard(const std::filesystem::path& bench, const char* program) noexcept {
  // It ends when the daemon ends, not when somebody asks the two of them to.
  for (const int ignored : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE}) signal(ignored, SIG_IGN);
  try {
    const BenchConfig config = read_bench(bench);
    const char ready = 'r';
    if (write(guardians_ready, &ready, 1) != 1) return 0;
    close(guardians_ready);
    char bye = 0;
    ssize_t got = 0;
    while ((got = read(guardians_watch, &bye, 1)) < 0 && errno == EINTR) {
    }
    if (got == 1) return 0;       // it ends in order
    constexpr int attempts = 40;  // the dying daemon's devices are let go one after the other
    for (int i = 1; i < attempts; ++i) {
      if (make_safe(config, nullptr) == 0) {
        std::fprintf(stderr, "%s: emtbd is gone without a word; the reference is safe\n", program);
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
