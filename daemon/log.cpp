#include "daemon/log.h"

#include <poll.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <climits>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "hal/printable.h"

namespace emtb {
namespace {

class NeverWaiting final : public spdlog::sinks::base_sink<std::mutex> {
 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t buffer;
    formatter_->format(message, buffer);
    std::string_view line(buffer.data(), buffer.size());
    if (!line.empty() && line.back() == '\n') line.remove_suffix(1);
    if (lost_ > 0 && write_line("emtbd: " + std::to_string(lost_) + " lines of this log were lost: nobody took them")) {
      lost_ = 0;
    }
    if (!write_line(printable(line))) ++lost_;
  }
  void flush_() override {}

 private:
  /// A pipe that takes anything takes PIPE_BUF bytes at once.
  static bool write_line(std::string line) {
    line.resize(std::min<std::size_t>(line.size(), PIPE_BUF - 1));
    line += '\n';
    pollfd takes{.fd = STDERR_FILENO, .events = POLLOUT, .revents = 0};
    if (poll(&takes, 1, 0) <= 0 || (takes.revents & POLLOUT) == 0) return false;
    return write(STDERR_FILENO, line.data(), line.size()) == static_cast<ssize_t>(line.size());
  }

  std::size_t lost_ = 0;
};

}  // namespace

void log_to_standard_error() {
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("emtbd", std::make_shared<NeverWaiting>()));
  spdlog::set_pattern("%Y-%m-%dT%H:%M:%S.%eZ %l: %v", spdlog::pattern_time_type::utc);
}

}  // namespace emtb
