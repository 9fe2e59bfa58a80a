#include "tools/kept/file_state.h"

#include <sys/stat.h>

#include <chrono>
#include <system_error>

namespace emtb {
namespace {

std::int64_t nanoseconds(const timespec& t) { return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec; }

}  // namespace

std::optional<FileState> look_at(const std::filesystem::path& path) {
  std::error_code failed;
  const std::filesystem::path whole = std::filesystem::absolute(path, failed);
  struct stat status {};
  if (failed || ::stat(whole.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return std::nullopt;
  // A file system's clock ticks some hundred times a second, FAT's every other one.
  constexpr std::int64_t coarsest_clock = 2'000'000'000;  // [ns]
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  FileState state{.path = whole.lexically_normal().string(),
                  .bytes = static_cast<std::uint64_t>(status.st_size),
                  .inode = status.st_ino,
                  .written = nanoseconds(status.st_mtim),
                  .changed = nanoseconds(status.st_ctim)};
  state.settled = std::chrono::duration_cast<std::chrono::nanoseconds>(now).count() - state.changed > coarsest_clock;
  return state;
}

bool seems_the_same(const FileState& before, const FileState& now) {
  return before.path == now.path && before.bytes == now.bytes && before.inode == now.inode &&
         before.written == now.written && before.changed == now.changed;
}

bool is_untouched(const FileState& before, const FileState& now) {
  return before.settled && seems_the_same(before, now);
}

}  // namespace emtb
