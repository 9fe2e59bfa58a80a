#include "daemon/realtime.h"

#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <system_error>

#include "hal/error.h"

namespace emtb {
namespace {

constexpr int priority = 80;  // above the kernel's threaded interrupts (50), below its watchdogs (99)

std::string reason(int error) { return std::generic_category().message(error); }

RealtimeStep lock_memory() {
  RealtimeStep step{.what = "memory locked"};
  // What is there now is what the loop needs: it takes nothing more. What others take later (a model, a request) is no
  // business of the memory that cannot be swapped.
  step.ok = mlockall(MCL_CURRENT) == 0;
  if (!step.ok) step.why = reason(errno) + "; needs LimitMEMLOCK=infinity or root";
  // A page of the stack that is touched here does not fault in the loop.
  std::array<volatile char, 64 * 1024> stack{};
  for (std::size_t i = 0; i < stack.size(); i += 4096) stack[i] = 1;
  return step;
}

RealtimeStep schedule() {
  RealtimeStep step{.what = "SCHED_FIFO priority " + std::to_string(priority)};
  const sched_param parameters{.sched_priority = priority};
  const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  step.ok = error == 0;
  if (!step.ok) step.why = reason(error) + "; needs LimitRTPRIO=" + std::to_string(priority) + " or root";
  return step;
}

RealtimeStep pin() {
  // The last processor that we may use: the first takes most interrupts.
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  RealtimeStep step{.what = "pinned to one processor"};
  if (sched_getaffinity(0, sizeof allowed, &allowed) != 0) {
    step.why = reason(errno);
    return step;
  }
  if (CPU_COUNT(&allowed) < 2) {
    step.ok = true;
    step.what += " (there is but one)";
    return step;
  }
  int last = CPU_SETSIZE - 1;
  while (!CPU_ISSET(last, &allowed)) --last;
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(last, &one);
  const int error = pthread_setaffinity_np(pthread_self(), sizeof one, &one);
  step.ok = error == 0;
  step.what = "pinned to processor " + std::to_string(last);
  if (!step.ok) step.why = reason(error);
  return step;
}

}  // namespace

RealtimeScope::RealtimeScope(Realtime wish) {
  if (wish == Realtime::off) return;
  steps_ = {lock_memory(), schedule(), pin()};
  scheduled_ = steps_[1].ok;

  RealtimeStep awake{.what = "processors kept awake (cpu_dma_latency 0 us)"};
  latency_ = open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
  const std::int32_t microseconds = 0;
  awake.ok = latency_ >= 0 && write(latency_, &microseconds, sizeof microseconds) == sizeof microseconds;
  if (!awake.ok) awake.why = reason(errno) + "; needs write access to /dev/cpu_dma_latency";
  steps_.push_back(awake);

  if (wish != Realtime::require) return;
  for (const RealtimeStep& step : steps_) {
    if (step.ok) continue;
    if (latency_ >= 0) close(latency_);
    throw Error("realtime: require, but not " + step.what + ": " + step.why + ". Or write realtime: prefer");
  }
}

RealtimeScope::~RealtimeScope() {
  if (latency_ >= 0) close(latency_);
}

}  // namespace emtb
