#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

namespace emtb::program {

/// Lines out of bytes, bounded in length and in number: what a program says must cost no more than it is worth.
///
/// A line that is too long counts as one and is given as its beginning, marked; whatever comes until its end is dropped
/// unread. More lines, or more bytes, than were agreed within a second are a flood.
class LineFeed {
 public:
  static constexpr std::size_t longest_line = 200;  ///< [bytes] without its end

  struct Line {
    std::string_view text;
    bool too_long = false;
  };

  /// @param lines_per_second the most that is taken
  explicit LineFeed(std::size_t lines_per_second) : most_lines_(lines_per_second) {}

  /// Calls `take(line)` for each that is whole. @param now [s]
  /// @return false: it is a flood, and the rest was not looked at
  bool feed(std::string_view bytes, double now, const std::function<void(const Line&)>& take);

 private:
  std::size_t most_lines_;
  double second_ = 0;  ///< [s] when the second began in which is counted
  std::size_t lines_ = 0, bytes_ = 0;
  std::string line_;
  bool too_long_ = false;
};

}  // namespace emtb::program
