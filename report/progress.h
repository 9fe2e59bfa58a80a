#pragma once

#include <cstdio>
#include <string>

namespace emtb {

/// One line on stderr that grows: only on a terminal; piped, nothing. It never goes back: work whose share was guessed
/// too large stands still until it has caught up.
class Progress {
 public:
  Progress();
  Progress(std::FILE* to, bool is_terminal);
  ~Progress();  ///< clears the line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// @param share 0 to 1; @param text behind the bar
  void show(double share, const std::string& text);

  /// A line without a bar.
  void show(const std::string& text);

  /// Takes the line away, so that others can write. What is shown next begins anew.
  void clear();

 private:
  std::FILE* to_;
  bool terminal_;
  double reached_ = 0;
  bool shown_ = false;
};

}  // namespace emtb
