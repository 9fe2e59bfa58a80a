#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <string>

namespace emtb {

/// What a script printed under the system's Python, which has h5py; a script that fails, fails the test.
inline std::string python(const std::string& script) {
  const std::string command = "/usr/bin/python3 - 2>&1 <<'END_OF_SCRIPT'\n" + script + "\nEND_OF_SCRIPT\n";
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) {
    ADD_FAILURE() << "no shell";
    return {};
  }
  std::string out;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) out += static_cast<char>(c);
  EXPECT_EQ(pclose(pipe), 0) << script << "\n" << out;
  return out;
}

}  // namespace emtb
