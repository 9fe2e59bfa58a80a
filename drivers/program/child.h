#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace emtb::program {

/// What a program is started as.
struct ChildSettings {
  std::vector<std::string> command;  ///< the program's path, its arguments; no shell
  std::string folder;                ///< that it starts in
  std::string user;                  ///< whom it becomes; empty: it stays who we are
};

/// Another program, in a process of its own that shares nothing with ours but three pipes.
///
/// It has none of our descriptors, environment, real-time priority, processors or limits, gains no privileges by what
/// it executes, and starts no processes of its own (threads it may): what it started could outlive it. It ignores
/// SIGTERM and SIGINT: it ends at the end of its stdin, or by our SIGKILL, and by the kernel's when we die in whatever
/// way (PR_SET_PDEATHSIG). That signal is tied to the *thread* that constructs it, which must live as long.
class Child {
 public:
  /// @throws DeviceError where it cannot be started
  explicit Child(const ChildSettings& settings);
  ~Child() { kill(); }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// Never waits. @return false where it does not take it
  bool say(std::string_view line) noexcept;
  /// Its stdin ends here.
  void hang_up() noexcept;

  int out() const noexcept { return out_; }         ///< readable: it has said something, or closed it
  int complaints() const noexcept { return err_; }  ///< its stderr
  pid_t pid() const noexcept { return pid_; }

  /// How it ended, in words: `it ended with code 1`; nothing while it lives. @param within [s] that are waited for that
  std::optional<std::string> ended(double within) noexcept;

  /// At once, and its process is gone from the table.
  void kill() noexcept;

 private:
  pid_t pid_ = 0;
  int in_ = -1, out_ = -1, err_ = -1;
  std::string how_;  ///< it ended
};

/// Where a command's program is: a path, or a name in /usr/local/bin, /usr/bin, /bin. Empty: nowhere.
std::string find_program(const std::string& name, const std::string& folder);

}  // namespace emtb::program
