#include "tools/compiler.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "hal/error.h"

namespace emtb {
namespace {

/// A folder that goes with this object.
class Workshop {
 public:
  Workshop() {
    std::string name = (std::filesystem::temp_directory_path() / "emtb-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw Error(name + ": " + std::strerror(errno) + ". Set TMPDIR to a folder");
    path = name;
  }
  ~Workshop() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  Workshop(const Workshop&) = delete;
  Workshop& operator=(const Workshop&) = delete;

  std::filesystem::path path;
};

int run(const std::vector<std::string>& words) {
  std::vector<char*> argv;
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  pid_t child = 0;
  const int why = posix_spawnp(&child, argv[0], nullptr, nullptr, argv.data(), environ);
  if (why != 0) {
    throw Error(words[0] + ": " + std::strerror(why) + ". An FMU needs a C compiler: apt-get install gcc, or set CC");
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

std::string compiled_library(const std::vector<std::pair<std::string, std::string>>& files, const std::string& source) {
  const Workshop shop;
  for (const auto& [name, text] : files) {
    std::filesystem::create_directories((shop.path / name).parent_path());
    std::ofstream(shop.path / name, std::ios::binary) << text;
  }
  const char* named = std::getenv("CC");
  const std::string compiler = named != nullptr && *named != '\0' ? named : "cc";
  const auto library = shop.path / "library.so";
  if (run({compiler, "-shared", "-fPIC", "-O2", "-std=c99", "-fvisibility=hidden", "-s", "-o", library.string(),
           (shop.path / source).string(), "-lm"}) != 0) {
    throw Error(compiler + " did not compile the model. What it says stands above");
  }
  std::ifstream in(library, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace emtb
