#include "drivers/card_input.h"

namespace emtb {
namespace {

constexpr double reopen_after = 0.5;  // [s] between attempts to open a card that has gone
constexpr double idle = 10;           // [s] of one wait without a scan
constexpr double loop_away = 0.5;     // [s] that the loop may be away before readings are lost

std::vector<Channel> opened(ScannedInputs& card, const std::string& name) {
  try {
    card.open();
  } catch (const DeviceError& e) {
    throw DeviceError(name + ": " + e.what());
  }
  return card.describe(name);
}

/// [readings]
std::size_t capacity(std::span<const Channel> channels) {
  const double readings = loop_away / channels.front().period * static_cast<double>(channels.size());
  return static_cast<std::size_t>(std::clamp(readings, 1024.0, 1e6));
}

}  // namespace

CardInput::CardInput(const std::string& name, std::shared_ptr<Clock> clock, std::unique_ptr<ScannedInputs> card)
    : clock_(std::move(clock)),
      card_(std::move(card)),
      descriptions_(opened(*card_, name)),
      handover_(descriptions_, capacity(descriptions_)),
      thread_([this] { run(); }) {}

CardInput::~CardInput() {
  quit_ = true;
  bell_.ring();
  thread_.join();
}

void CardInput::start() {
  handover_.restart();
  wanted_ = true;
  bell_.ring();
}

void CardInput::run() noexcept {
  bool open = true;
  while (!quit_) {
    if (!wanted_) {
      bell_.wait(idle);
      continue;
    }
    try {
      if (!open) card_->open();
      open = true;
      Scan scan(descriptions_, card_->width(), handover_, *clock_, clock_report_, quit_);
      card_->run(scan);
    } catch (const ScanBroken& broken) {
      handover_.raise(broken.fault);
    } catch (const std::exception&) {  // it has gone, or is not back yet
      card_->close();
      open = false;
      handover_.raise(Fault::device_lost);
      bell_.wait(reopen_after);
    }
  }
}

}  // namespace emtb
