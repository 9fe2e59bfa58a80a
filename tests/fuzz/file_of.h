#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <string_view>

#include "tests/fuzz/targets.h"

namespace emtb::fuzz {

/// A file in memory, for what reads files: a name under /proc, no disk.
class FileOf {
 public:
  explicit FileOf(std::string_view bytes) : file_(memfd_create("fuzz", MFD_CLOEXEC)) {
    must(file_ >= 0, "a file in memory can be had");
    for (std::size_t at = 0; at < bytes.size();) {
      const ssize_t n = write(file_, bytes.data() + at, bytes.size() - at);
      must(n > 0, "it can be written");
      at += static_cast<std::size_t>(n);
    }
  }
  ~FileOf() { close(file_); }
  FileOf(const FileOf&) = delete;
  FileOf& operator=(const FileOf&) = delete;

  std::filesystem::path path() const { return "/proc/self/fd/" + std::to_string(file_); }

 private:
  int file_;
};

}  // namespace emtb::fuzz
