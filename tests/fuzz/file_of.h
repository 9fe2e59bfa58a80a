#pragma once

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

#include "tests/fuzz/targets.h"

namespace emtb::fuzz {

/// A file for what reads files, gone with this. In memory where that can be had, and under a name of its own: HDF5
/// opens none that is only a descriptor.
class FileOf {
 public:
  explicit FileOf(std::string_view bytes) {
    const std::filesystem::path memory = "/dev/shm";
    const auto folder = std::filesystem::is_directory(memory) ? memory : std::filesystem::temp_directory_path();
    path_ = (folder / "emtb-fuzz-XXXXXX").string();
    const int file = mkstemp(path_.data());
    must(file >= 0, "a file can be had");
    for (std::size_t at = 0; at < bytes.size();) {
      const ssize_t n = write(file, bytes.data() + at, bytes.size() - at);
      must(n > 0, "it can be written");
      at += static_cast<std::size_t>(n);
    }
    close(file);
  }
  ~FileOf() { unlink(path_.c_str()); }
  FileOf(const FileOf&) = delete;
  FileOf& operator=(const FileOf&) = delete;

  std::filesystem::path path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace emtb::fuzz
