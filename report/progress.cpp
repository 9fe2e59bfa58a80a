#include "report/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace emtb {
namespace {

constexpr int width = 30;  // [characters] of the bar
constexpr const char* clear_line = "\r\033[K";

}  // namespace

Progress::Progress() : Progress(stderr, isatty(STDERR_FILENO) == 1) {}

Progress::Progress(std::FILE* to, bool is_terminal) : to_(to), terminal_(is_terminal) {}

Progress::~Progress() { clear(); }

void Progress::clear() {
  if (shown_) std::fputs(clear_line, to_);
  shown_ = false;
  reached_ = 0;
}

void Progress::show(double share, const std::string& text) {
  if (std::isfinite(share)) reached_ = std::max(reached_, std::min(share, 1.0));
  const auto full = static_cast<std::size_t>(std::lround(reached_ * width));
  show("[" + std::string(full, '=') + std::string(width - full, ' ') + "] " + text);
}

void Progress::show(const std::string& text) {
  if (!terminal_) return;
  std::fputs((clear_line + text).c_str(), to_);
  std::fflush(to_);
  shown_ = true;
}

}  // namespace emtb
