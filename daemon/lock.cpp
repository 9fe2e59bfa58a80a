#include "daemon/lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "hal/error.h"

namespace emtb {

PathLock::PathLock(const std::filesystem::path& path, const std::string& what)
    : file_(open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
  const auto reason = [] { return std::generic_category().message(errno); };
  if (file_ < 0) throw Error(path.string() + ": the " + what + " cannot be opened: " + reason());
  if (flock(file_, LOCK_EX | LOCK_NB) == 0) return;
  const bool taken = errno == EWOULDBLOCK;
  const std::string why = reason();
  close(file_);
  throw Error(path.string() + ": " +
              (taken ? "another emtbd uses this " + what + ". Stop it first, or give another"
                     : "the " + what + " cannot be locked: " + why));
}

PathLock::~PathLock() { close(file_); }

}  // namespace emtb
