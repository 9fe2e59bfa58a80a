#pragma once

#include <sys/types.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "server/client.h"

namespace emtb {

/// An emtbd of the command line's own, from beside this program, in a temporary folder. Both are gone with it.
class OwnDaemon {
 public:
  /// Makes the folder; nothing runs yet. @throws Error
  OwnDaemon();
  ~OwnDaemon();
  OwnDaemon(const OwnDaemon&) = delete;
  OwnDaemon& operator=(const OwnDaemon&) = delete;

  const std::filesystem::path& folder() const { return folder_; }

  /// Starts it on a bench, and waits until it answers. @param more further words of its command line
  /// @throws Error where it ends instead: its last words
  std::unique_ptr<Client> start(const std::filesystem::path& config, const std::filesystem::path& data,
                                const std::vector<std::string>& more = {});

 private:
  bool running();
  std::string last_words() const;

  std::filesystem::path folder_;
  pid_t pid_ = 0;
};

}  // namespace emtb
