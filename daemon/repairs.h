#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>

namespace emtb {

/// Repairs what recordings that ended abruptly have left in a folder, while the bench is in service: one file at a
/// time, each in a process of its own, of bounded time and memory, never one that is being recorded. What kills or
/// stalls that process is renamed `*.unreadable`, so that it is met but once.
class Repairs {
 public:
  /// @param program what repairs: `emtbd --repair FILE`
  Repairs(std::filesystem::path folder, std::filesystem::path program, std::function<void(const std::string&)> log);
  ~Repairs();  ///< ends the one that is on; its file stands as it was
  Repairs(const Repairs&) = delete;
  Repairs& operator=(const Repairs&) = delete;

 private:
  void work();
  void repair_all() const;
  void repair(const std::filesystem::path& file) const;

  const std::filesystem::path folder_, program_;
  const std::function<void(const std::string&)> log_;
  std::atomic<bool> quit_{false};
  std::thread thread_;
};

}  // namespace emtb
