#include "daemon/lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <system_error>

#include "hal/error.h"

namespace emtb {
namespace {

std::string reason() { return std::generic_category().message(errno); }

/// The file to lock for that one.
std::filesystem::path lock_file(const struct stat& about) {
  return lock_folder() / (std::to_string(about.st_dev) + "-" + std::to_string(about.st_ino) + ".lock");
}

}  // namespace

std::filesystem::path lock_folder() {
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  std::filesystem::path within = runtime != nullptr && *runtime != '\0' ? runtime : "/run/emtb";
  if (access(within.c_str(), W_OK | X_OK) != 0) within = "/tmp";
  const auto folder = within / ("emtbd-" + std::to_string(geteuid()));
  struct stat about {};
  if (mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) {
    throw Error(folder.string() + ": the folder for locks cannot be made: " + reason());
  }
  if (lstat(folder.c_str(), &about) != 0 || !S_ISDIR(about.st_mode) || about.st_uid != geteuid() ||
      (about.st_mode & 0077) != 0) {
    throw Error(folder.string() + ": is not a folder of ours alone. Remove it, or set XDG_RUNTIME_DIR");
  }
  return folder;
}

PathLock::PathLock(const std::filesystem::path& path, const std::string& what) {
  struct stat about {};
  if (stat(path.c_str(), &about) != 0) throw Error(path.string() + ": the " + what + " cannot be opened: " + reason());
  lock_ = lock_file(about);
  while (true) {
    file_ = open(lock_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (file_ < 0) throw Error(lock_.string() + ": the lock of the " + what + " cannot be opened: " + reason());
    if (flock(file_, LOCK_EX | LOCK_NB) != 0) {
      const bool taken = errno == EWOULDBLOCK;
      const std::string why = reason();
      close(file_);
      throw Error(path.string() + ": " +
                  (taken ? "another emtbd uses this " + what + ". Stop it first, or give another"
                         : "the " + what + " cannot be locked: " + why));
    }
    // Whoever held it may have removed it between our two calls: then it is locked, but nobody would find it.
    struct stat ours {
    }, there{};
    if (fstat(file_, &ours) == 0 && stat(lock_.c_str(), &there) == 0 && ours.st_ino == there.st_ino) return;
    close(file_);
  }
}

PathLock::~PathLock() {
  unlink(lock_.c_str());
  close(file_);
}

}  // namespace emtb
