#include "drivers/serial_meter/conversation.h"

#include <poll.h>

#include <algorithm>

namespace emtb::serial_meter {

bool Conversation::ended() const {
  pollfd wish{.fd = wish_to_end_, .events = POLLIN, .revents = 0};
  return ::poll(&wish, 1, 0) > 0;
}

Message Conversation::next() {
  while (!received_.empty()) {
    const Message message = find_(received_);
    if (message.kind == Message::Kind::partial) break;
    received_.erase(0, message.length);
    if (message.kind != Message::Kind::noise) return message;
  }
  return {};
}

Message Conversation::listen(double until) {
  while (true) {
    if (const Message message = next(); message.kind != Message::Kind::partial) return message;
    if (const std::string_view got = port_.read(buffer_); !got.empty()) {
      received_ += got;
      continue;
    }
    const double left = until - machine_.now();
    if (left <= 0 || ended()) return {};
    port_.wait(left, wish_to_end_);
  }
}

void Conversation::settle(double quiet, double at_most) {
  const double end = machine_.now() + at_most;
  double silent_since = machine_.now();
  while (!ended()) {
    const double now = machine_.now();
    if (!port_.read(buffer_).empty()) silent_since = now;
    if (now - silent_since >= quiet || now >= end) break;
    port_.wait(std::min(silent_since + quiet, end) - now, wish_to_end_);
  }
  received_.clear();
}

}  // namespace emtb::serial_meter
