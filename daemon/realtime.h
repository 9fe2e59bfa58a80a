#pragma once

#include <string>
#include <vector>

#include "config/bench.h"

namespace emtb {

/// One thing that was tried to make the loop punctual, and what came of it.
struct RealtimeStep {
  std::string what;  ///< `SCHED_FIFO priority 80`
  bool ok = false;
  std::string why{};  ///< where it failed: the system's reason and what would help
};

/// Real-time settings of the calling thread and of the process; what must be held open is let go by the destructor.
///
/// Each step is tried by itself: on a desktop some fail, and the bench still runs. `require` is for benches where it
/// must not.
class RealtimeScope {
 public:
  /// Call on the loop's thread. @throws Error where `wish` is `require` and a step failed, naming it.
  explicit RealtimeScope(Realtime wish);
  ~RealtimeScope();
  RealtimeScope(const RealtimeScope&) = delete;
  RealtimeScope& operator=(const RealtimeScope&) = delete;

  const std::vector<RealtimeStep>& steps() const noexcept { return steps_; }

  /// The thread has a real-time priority: no other program can keep it from a deadline for which it waits awake.
  bool scheduled() const noexcept { return scheduled_; }

 private:
  bool scheduled_ = false;
  int latency_ = -1;  // /dev/cpu_dma_latency: the wish holds as long as the file is open
  std::vector<RealtimeStep> steps_;
};

}  // namespace emtb
