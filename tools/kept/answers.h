#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tools/kept/file_state.h"

namespace emtb {

/// What a command said and wrote.
struct Answer {
  int code = 0;
  std::string out, err;
  std::vector<std::string> written;  ///< the files it wrote, whole, in the order of the question
};

/// Answers in a folder of the user's, each in a file named by its question.
///
/// An answer stands for the bytes of the files that it was made of. Whether they are the same is told by their places
/// and times, and where these have moved by their SHA-256. Nothing that is read here is believed: an answer that is cut
/// off, changed or not understood is none. Several processes may keep and find at a time.
class Answers {
 public:
  static constexpr std::uint64_t most_bytes = std::uint64_t{2} << 30;  ///< of all; those found longest ago go first
  static constexpr std::uint64_t longest = std::uint64_t{64} << 20;    ///< [byte] of one; longer ones are not kept

  /// @param folder made when it is first needed, for its owner alone
  explicit Answers(std::filesystem::path folder, std::uint64_t most = most_bytes);

  /// @param question all that an answer depends on but for the bytes of the files
  /// @param files as they are now
  std::optional<Answer> find(const std::string& question, std::span<const FileState> files) const;

  /// Where there is no place for it, it is not kept, and nobody is told.
  void keep(const std::string& question, std::span<const FileState> files, const Answer& answer) const;

 private:
  std::filesystem::path place_of(const std::string& question, std::span<const FileState> files) const;
  void make_room(std::uint64_t bytes) const;

  std::filesystem::path folder_;
  std::uint64_t most_;
};

}  // namespace emtb
