#pragma once

#include <pty.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/process.h"
#include "tests/session/scratch.h"

namespace emtb {

/// `emtb` on files, as a person calls it.
class CommandCaller : public Scratch {
 protected:
  /// @return its exit code
  int call(std::vector<std::string> words) {
    words.insert(words.begin(), EMTB);
    last = std::make_unique<Process>(words, path("emtb" + std::to_string(++launched_)));
    return last->wait(300);
  }

  /// In the folder of this test. @return what it writes to a terminal of so many columns, its lines as they are shown
  std::vector<std::string> lines_on_terminal(std::vector<std::string> words, unsigned short columns) const {
    words.insert(words.begin(), EMTB);
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    winsize size{.ws_row = 25, .ws_col = columns, .ws_xpixel = 0, .ws_ypixel = 0};
    int terminal = -1;
    const pid_t pid = forkpty(&terminal, nullptr, nullptr, &size);
    if (pid < 0) throw std::runtime_error("forkpty");
    if (pid == 0) {
      if (chdir(path("").c_str()) != 0) _exit(126);
      execv(argv[0], argv.data());
      _exit(127);
    }
    std::string text;
    char part[4096];
    for (ssize_t n = 0; (n = ::read(terminal, part, sizeof part)) > 0;) text.append(part, static_cast<std::size_t>(n));
    ::close(terminal);
    waitpid(pid, nullptr, 0);
    std::erase(text, '\r');
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
  }

  std::unique_ptr<Process> last;

 private:
  int launched_ = 0;
};

}  // namespace emtb
