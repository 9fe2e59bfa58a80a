#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace emtb {

/// Gives the answer of a command again where the same was asked before, of files that have not changed since.
///
/// A question is the words as typed, the program by its build id, and what the terminal makes of the answer; the
/// command says which files it reads and writes. Only commands that depend on nothing else may be asked this way.
/// Answers lie in `$XDG_CACHE_HOME/emtb/answers`, else `~/.cache/emtb/answers` (docs/decisions/kept-answers.md).
class KeptAnswers {
 public:
  /// @param words of the command line, without the program
  explicit KeptAnswers(std::vector<std::string> words);

  bool off = false;  ///< `--no-cache`: neither looked for nor kept

  /// What a command's answer is made of, and where it goes beside the terminal.
  struct Files {
    std::vector<std::filesystem::path> reads, writes;
  };

  /// @param work the command itself; what it says, it says on std::cout and std::cerr
  /// @return its exit code, of now or of then; 2 and what is thrown is never kept
  int answer(const Files& files, const std::function<int()>& work) const;

 private:
  std::vector<std::string> words_;
};

/// The files that a command reads.
/// @param paths of a model, a mapping ...; empty: it was given none
/// @param sessions, held_out as they are named: `PATH[#RUN][@T0:T1]`
std::vector<std::filesystem::path> files_read(const std::vector<std::string>& paths,
                                              const std::vector<std::string>& sessions,
                                              const std::vector<std::string>& held_out = {});

/// Those that it writes. @param paths empty: it was told to write none; -: to the standard output
std::vector<std::filesystem::path> files_written(const std::vector<std::string>& paths);

}  // namespace emtb
