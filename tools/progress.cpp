#include "tools/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace emtb {
namespace {

constexpr int width = 30;  // [characters] of the bar
constexpr const char* clear_line = "\r\033[K";

}  // namespace

Progress::Progress() : terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() { clear(); }

void Progress::clear() {
  if (shown_) std::fputs(clear_line, stderr);
  shown_ = false;
}

void Progress::show(double share, const std::string& text) {
  const double within = std::isfinite(share) ? std::clamp(share, 0.0, 1.0) : 0;
  const auto full = static_cast<std::size_t>(std::lround(within * width));
  show("[" + std::string(full, '=') + std::string(width - full, ' ') + "] " + text);
}

void Progress::show(const std::string& text) {
  if (!terminal_) return;
  std::fputs((clear_line + text).c_str(), stderr);
  std::fflush(stderr);
  shown_ = true;
}

}  // namespace emtb
