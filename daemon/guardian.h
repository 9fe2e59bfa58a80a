#pragma once

#include <sys/types.h>

#include <filesystem>

namespace emtb {

/// A small process beside the daemon that makes the reference safe when the daemon is gone, in whatever way: `emtb-safe
/// --guard`. It has read the bench before the bench is opened, and waits at the other end of a pipe, which the kernel
/// closes with the daemon.
class Guardian {
 public:
  /// @param program emtb-safe; @param bench its file
  Guardian(std::filesystem::path program, std::filesystem::path bench)
      : program_(std::move(program)), bench_(std::move(bench)) {}
  ~Guardian() { dismiss(); }
  Guardian(const Guardian&) = delete;
  Guardian& operator=(const Guardian&) = delete;

  /// Starts it and waits until it is on guard. @return whether it is
  bool start();

  /// Whether it has ended since it was started. Told once.
  bool has_died();

  /// The daemon ends in order and makes safe itself.
  void dismiss();

 private:
  const std::filesystem::path program_, bench_;
  pid_t process_ = 0;
  int watch_ = -1;
};

/// The descriptors of a guardian: where it sees the daemon's end, and where it says that it is on guard.
inline constexpr int guardians_watch = 3, guardians_ready = 4;

/// What `emtb-safe --guard` does: reads the bench, says that it is on guard, waits for the daemon's end, and makes
/// safe.
/// @return the exit status, as make_safe()
int keep_guard(const std::filesystem::path& bench, const char* program) noexcept;

}  // namespace emtb
