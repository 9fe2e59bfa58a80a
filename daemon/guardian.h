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

  /// The loop is at work. Once told, the guardian ends a daemon from which it hears nothing for two seconds: one that
  /// was stopped, or stands still, holds the reference as it is.
  void sign_of_life() { tell('a'); }

  /// There will be no more of them: the daemon is about to end.
  void expect_none() { tell('n'); }

  /// The daemon ends in order and makes safe itself.
  void dismiss();

 private:
  void tell(char what);

  const std::filesystem::path program_, bench_;
  pid_t process_ = 0;
  int watch_ = -1;
};

/// The descriptors of a guardian: where it sees the daemon's end, and where it says that it is on guard.
inline constexpr int guardians_watch = 3, guardians_ready = 4;

/// What `emtb-safe --guard` does: reads the bench, says that it is on guard, waits for the daemon's end, and makes
/// safe. A daemon that stands still it ends first: nobody else can have its devices while it lives.
/// @return the exit status, as make_safe()
int keep_guard(const std::filesystem::path& bench, const char* program) noexcept;

}  // namespace emtb
