#pragma once

#include <sys/types.h>

#include <array>
#include <string>
#include <vector>

namespace emtb::program {

/// Whom a process becomes.
struct Identity {
  uid_t user = 0;
  gid_t group = 0;
  std::vector<gid_t> groups;  ///< all
};

/// All that a child does between its fork and its program, prepared before: it shares our memory until then, so it only
/// makes system calls.
struct Confinement {
  std::array<int, 3> ends{};  ///< what becomes its stdin, stdout and stderr; each above 2
  pid_t parent = 0;           ///< ours
  const char* folder = nullptr;
  char* const* words = nullptr;
  char* const* surroundings = nullptr;
  const Identity* identity = nullptr;  ///< null: it stays who we are

  // Where it failed.
  const char* step = nullptr;
  int error = 0;
};

/// Becomes the program, confined as Child says. Returns only where that fails, and says at which step.
void become(Confinement& confinement) noexcept;

}  // namespace emtb::program
