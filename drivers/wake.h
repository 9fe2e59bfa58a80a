#pragma once

#include <atomic>

#include "drivers/doorbell.h"

namespace emtb {

/// Asks a device's thread to end, and wakes it wherever it waits: a bell that nobody answers.
class Wake {
 public:
  void wish() noexcept {
    wished_ = true;
    bell_.ring();
  }
  bool wished() const noexcept { return wished_; }
  /// Waits so long, or until the wish.
  void rest(double seconds) const noexcept { bell_.listen(seconds); }
  int descriptor() const noexcept { return bell_.descriptor(); }  ///< readable from the wish on

 private:
  Doorbell bell_;
  std::atomic<bool> wished_ = false;
};

}  // namespace emtb
