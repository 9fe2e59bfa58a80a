#pragma once

#include <string>

namespace emtb {

/// One line on stderr that grows: only on a terminal; piped, nothing.
class Progress {
 public:
  Progress();
  ~Progress();  ///< clears the line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// @param share 0 to 1; @param text behind the bar
  void show(double share, const std::string& text);

  /// A line without a bar.
  void show(const std::string& text);

  /// Takes the line away, so that others can write.
  void clear();

 private:
  bool terminal_;
  bool shown_ = false;
};

}  // namespace emtb
