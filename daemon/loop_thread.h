#pragma once

#include <atomic>
#include <functional>
#include <thread>
#include <vector>

#include "daemon/loop.h"
#include "daemon/realtime.h"

namespace emtb {

/// Gives the loop its thread and its beat.
class LoopThread {
 public:
  struct Settings {
    double period = 1e-3;  ///< [s]
    Realtime realtime = Realtime::prefer;
    std::function<void(bool busy)>
        pace;  ///< simulated time: called when a run begins and when it is over; may be empty
  };

  /// Starts the devices and the beat. @throws Error where real time is required and cannot be had.
  LoopThread(Loop& loop, Clock& clock, Live& live, Settings settings);
  ~LoopThread();  ///< ends the thread; the reference stays as it is
  LoopThread(const LoopThread&) = delete;
  LoopThread& operator=(const LoopThread&) = delete;

  /// What was tried for real time.
  const std::vector<RealtimeStep>& realtime() const noexcept { return steps_; }

 private:
  void run(bool scheduled);

  Loop& loop_;
  Clock& clock_;
  Live& live_;
  Settings settings_;
  std::vector<RealtimeStep> steps_;
  std::atomic<bool> quit_{false};
  std::thread thread_;
};

}  // namespace emtb
