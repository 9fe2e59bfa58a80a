#pragma once

#include <memory>
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

  std::unique_ptr<Process> last;

 private:
  int launched_ = 0;
};

}  // namespace emtb
