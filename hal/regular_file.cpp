#include "hal/regular_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <new>
#include <system_error>

#include "hal/error.h"

namespace emtb {
namespace {

struct Closed {
  int file;
  ~Closed() {
    if (file >= 0) close(file);
  }
};

std::string size_in_words(std::uint64_t bytes) {
  constexpr std::uint64_t kilo = 1024;
  if (bytes >= kilo * kilo * kilo) return std::to_string(bytes / (kilo * kilo * kilo)) + " GiB";
  if (bytes >= kilo * kilo) return std::to_string(bytes / (kilo * kilo)) + " MiB";
  return std::to_string(bytes) + " bytes";
}

}  // namespace

std::string read_regular_file(const std::filesystem::path& path, std::uint64_t longest, const std::string& wanted) {
  const auto fail = [&](const std::string& why) { throw Error(path.string() + ": " + why + ". Give " + wanted); };
  const auto reason = [] { return std::generic_category().message(errno); };
  // Without O_NONBLOCK a pipe would be waited for before we could see that it is one.
  const Closed opened{open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY)};
  struct stat about {};
  if (opened.file < 0 || fstat(opened.file, &about) != 0) {
    fail("cannot be read: " + (errno == ENOENT ? "no such file" : reason()));
  }
  if (S_ISDIR(about.st_mode)) fail("cannot be read: is a folder");
  if (!S_ISREG(about.st_mode)) fail("is a pipe or a device, no file that ends");
  const auto size = static_cast<std::uint64_t>(about.st_size);
  if (size > longest) fail("is larger than " + size_in_words(longest));
  std::string text;
  try {
    text.resize(std::max<std::uint64_t>(size, 1));
    std::size_t got = 0;
    while (true) {
      const ssize_t n = read(opened.file, text.data() + got, text.size() - got);
      if (n < 0) fail("cannot be read: " + reason());
      if (n == 0) break;
      got += static_cast<std::size_t>(n);
      if (got > longest) fail("is larger than " + size_in_words(longest));
      if (got == text.size()) text.resize(std::min<std::uint64_t>(2 * got, longest + 1));  // it grows, or is of /proc
    }
    text.resize(got);
  } catch (const std::bad_alloc&) {
    fail("is larger than the memory that is free");
  }
  return text;
}

}  // namespace emtb
