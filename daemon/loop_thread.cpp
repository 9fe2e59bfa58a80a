#include "daemon/loop_thread.h"

#include <exception>
#include <future>

#include "daemon/early_wake.h"
#include "hal/deadline.h"

namespace emtb {

LoopThread::LoopThread(Loop& loop, Clock& clock, Live& live, Settings settings)
    : loop_(loop), clock_(clock), live_(live), settings_(std::move(settings)) {
  std::promise<std::vector<RealtimeStep>> tried;
  auto steps = tried.get_future();
  thread_ = std::thread([this, tried = std::move(tried)]() mutable {
    try {
      const RealtimeScope scope(settings_.realtime);
      tried.set_value(scope.steps());
      run(scope.scheduled());
    } catch (const std::exception&) {  // only RealtimeScope throws, before the value is set
      tried.set_exception(std::current_exception());
    }
  });
  try {
    steps_ = steps.get();
  } catch (...) {
    thread_.join();
    throw;
  }
}

LoopThread::~LoopThread() {
  quit_ = true;
  thread_.join();
}

void LoopThread::run(bool scheduled) {
  loop_.start();
  Deadline deadline(clock_.now(), settings_.period);
  EarlyWake early(settings_.period);
  const bool awake = scheduled && !settings_.pace;  // simulated time waits for nobody
  bool busy = false;
  while (!quit_.load(std::memory_order_relaxed)) {
    if (loop_.wanted()) {
      loop_.prepare();
      deadline.restart(clock_.now());
    }
    if (loop_.busy() != busy) {
      busy = loop_.busy();
      if (settings_.pace) settings_.pace(busy);
      deadline.restart(clock_.now());
    }
    const double asked = deadline.next() - (awake ? early.margin() : 0);
    const bool sleeps = awake && clock_.now() < asked;
    clock_.sleep_until(asked);
    double now = clock_.now();
    if (sleeps) early.slept(now - asked);
    while (awake && now < deadline.next()) now = clock_.now();
    const bool real_time = !busy || !settings_.pace;
    if (real_time) live_.lateness.add(now - deadline.next());
    loop_.tick(now, deadline.woke(now));
    if (real_time) live_.work.add(clock_.now() - now);
  }
}

}  // namespace emtb
