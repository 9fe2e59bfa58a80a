#pragma once

#include <filesystem>
#include <functional>

#include "session/session.h"

namespace emtb {

/// Has a child process read a session: a damaged file may make a library crash, loop for good or take more memory than
/// there is. The child has bounded time and memory and ends with this process; of what it hands over through a pipe
/// nothing is believed unseen. Private to session/.
/// @throws SessionError that `read` threw, or where the child died
Session read_in_child(const std::filesystem::path& file,
                      const std::function<Session(const std::filesystem::path&)>& read);

/// Bounds what reading this file may cost this process, in time and memory; it ends with its parent.
void bound_this_process(const std::filesystem::path& file);

}  // namespace emtb
