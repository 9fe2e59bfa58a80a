#include "drivers/program/line_feed.h"

#include <algorithm>
#include <utility>

namespace emtb::program {

bool LineFeed::feed(std::string_view bytes, double now, const std::function<void(const Line&)>& take) {
  if (now - second_ >= 1) {
    second_ = now;
    lines_ = bytes_ = 0;
  }
  bytes_ += bytes.size();
  if (bytes_ > most_lines_ * (longest_line + 1)) return false;
  while (!bytes.empty()) {
    const std::size_t end = bytes.find('\n');
    const std::string_view part = bytes.substr(0, end);
    const std::size_t room = longest_line - line_.size();
    too_long_ = too_long_ || part.size() > room;
    line_ += part.substr(0, room);
    if (end == std::string_view::npos) return true;
    bytes.remove_prefix(end + 1);
    if (++lines_ > most_lines_) return false;
    if (line_.ends_with('\r')) line_.pop_back();
    take({.text = line_, .too_long = std::exchange(too_long_, false)});
    line_.clear();
  }
  return true;
}

}  // namespace emtb::program
