#pragma once

#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <set>
#include <string>
#include <thread>

namespace emtb {

/// Who does what, among processes that see one folder, on one machine or many: a claim is a file that only one of them
/// can make. A process that dies leaves its claims behind; others see that they are not kept up any more, and take them
/// over. Where one that seemed dead was only slow, both do the same work with the same result, which loses time alone.
///
/// Thread-safe.
class Claims {
 public:
  /// @param patience [s] after which a claim of another machine that is not kept up counts as left behind
  /// @throws Error where the folder cannot be made
  Claims(std::filesystem::path folder, double patience);
  ~Claims();
  Claims(const Claims&) = delete;
  Claims& operator=(const Claims&) = delete;

  /// @return how often it has been taken, this time included, by whoever did not let it go; 0: somebody else has it
  int take(const std::string& name);

  /// Done with it.
  void let_go(const std::string& name);

  /// Nothing is left to do of it: a claim that a process left behind, which died when it was just done, goes.
  void clear(const std::string& name);

 private:
  void remove_old_drafts() const;
  bool make(const std::string& name, int times);
  bool is_left_behind(const std::filesystem::path& claim, const std::string& text) const;
  double age_of(const std::filesystem::path& claim) const;
  void keep_up();

  std::filesystem::path folder_;
  double patience_;  // [s]
  std::string me_;   // machine and process
  std::mutex mutex_;
  std::condition_variable ends_;
  std::set<std::string> held_;
  bool ending_ = false;
  std::jthread keeper_;
};

}  // namespace emtb
