#include "tests/blind/wide/command.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include "hal/error.h"

namespace emtb::blind::wide {
namespace {

std::string last_line_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line, last;
  while (std::getline(in, line)) {
    if (!line.empty()) last = line;
  }
  return last;
}

[[noreturn]] void become(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                         const std::filesystem::path& folder, const std::string& log) {
  std::vector<std::string> words{program.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  if (chdir(folder.c_str()) != 0) _exit(127);
  const int out = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  const int err = open((log + ".err").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  const int none = open("/dev/null", O_RDONLY);
  dup2(none, 0);
  dup2(out, 1);
  dup2(err, 2);
  execv(argv[0], argv.data());
  _exit(127);
}

}  // namespace

Ended run_command(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                  const std::filesystem::path& folder, const std::string& log, double longest) {
  const auto start = std::chrono::steady_clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  const std::filesystem::path absolute = std::filesystem::absolute(program);
  const pid_t child = fork();
  if (child < 0) throw Error("no process can be started");
  if (child == 0) become(absolute, arguments, folder, log);
  Ended ended;
  int status = 0;
  while (waitpid(child, &status, WNOHANG) == 0) {
    if (seconds() > longest && ended.in_time) {
      ended.in_time = false;
      kill(child, SIGKILL);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  ended.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  ended.seconds = seconds();
  ended.last_line = last_line_of(folder / (log + ".err"));
  if (ended.code == 127) throw Error(absolute.string() + ": cannot be started. Build `emtb`, or give --emtb PATH");
  return ended;
}

std::string as_typed(const std::filesystem::path& program, const std::vector<std::string>& arguments) {
  std::string line = program.string();
  for (const std::string& word : arguments) line += " " + word;
  return line;
}

}  // namespace emtb::blind::wide
