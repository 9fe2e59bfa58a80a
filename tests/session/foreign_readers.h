#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <string>

namespace emtb {

/// What a command printed to which a script was given; one that fails, fails the test.
inline std::string output_of(const std::string& command, const std::string& script) {
  const std::string whole = command + " <<'END_OF_SCRIPT'\n" + script + "\nEND_OF_SCRIPT\n";
  FILE* pipe = popen(whole.c_str(), "r");
  if (pipe == nullptr) {
    ADD_FAILURE() << "no shell";
    return {};
  }
  std::string out;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) out += static_cast<char>(c);
  EXPECT_EQ(pclose(pipe), 0) << script << "\n" << out;
  return out;
}

/// What a script printed under the system's Python, which has h5py.
inline std::string python(const std::string& script) { return output_of("/usr/bin/python3 - 2>&1", script); }

/// The same under Octave. What it complains of while it ends is its own matter.
inline std::string octave(const std::string& script) {
  return output_of("/usr/bin/octave-cli --no-gui --norc --quiet 2>/dev/null", script);
}

}  // namespace emtb
