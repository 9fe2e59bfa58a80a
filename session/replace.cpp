#include "session/replace.h"

#include <fcntl.h>
#include <unistd.h>

#include "hal/error.h"

namespace emtb {
namespace {

bool bring_to_disk(const std::filesystem::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return false;
  const bool done = ::fsync(fd) == 0;
  return ::close(fd) == 0 && done;
}

}  // namespace

void replace_file(const std::filesystem::path& path, const std::function<void(const std::filesystem::path&)>& write) {
  std::filesystem::path draft = path;
  draft += ".draft";
  std::error_code error;
  std::filesystem::remove(draft, error);  // left by a process that died
  try {
    write(draft);
    const auto old = std::filesystem::status(path, error);
    if (std::filesystem::is_regular_file(old)) std::filesystem::permissions(draft, old.permissions(), error);
    if (!bring_to_disk(draft)) throw SessionError(path.string() + ": cannot be brought to the disk. Is it full?");
    std::filesystem::rename(draft, path, error);
    if (error) throw SessionError(path.string() + ": cannot be replaced: " + error.message());
  } catch (...) {
    std::filesystem::remove(draft, error);
    throw;
  }
}

}  // namespace emtb
