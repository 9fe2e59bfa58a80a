#include "drivers/card_output.h"

namespace emtb {
namespace {

constexpr double between_checks = 0.25;  // [s]
constexpr double retry_after = 0.1;      // [s] between attempts to reach a card that does not answer
constexpr double longest_request =
    0.2;  // [s] one over USB takes 0.3 ms, a register less; a busy machine adds some tens

}  // namespace

CardOutput::CardOutput(std::string name, std::unique_ptr<CardConverter> converter, const Limits& limits, bool read_back)
    : converter_(std::move(converter)), read_back_(read_back), target_(limits, bell_) {
  try {
    converter_->open(false);
    open_ = true;
    write(converter_->code(limits.safe));
    check();
  } catch (const NoReadBack& e) {
    throw DeviceError(name + ": " + e.what() + ". If it cannot be read back, write read_back: false under reference");
  } catch (const DeviceError& e) {
    throw DeviceError(name + ": " + e.what());
  }
  thread_ = std::thread([this] { run(); });
}

CardOutput::~CardOutput() {
  make_safe();
  quit_ = true;
  bell_.ring();
  thread_.join();
}

Fault CardOutput::set(double volts) noexcept {
  if (target_.set(volts)) return verdict();
  make_safe();
  return Fault::non_finite;
}

Fault CardOutput::make_safe() noexcept {
  anew_ = true;
  target_.make_safe();
  return verdict();
}

Fault CardOutput::verdict() const noexcept {
  return machine_.now() - busy_since_ > longest_request ? Fault::output_failed : fault_.load();
}

void CardOutput::write(std::uint32_t code) {
  converter_->write(code);
  written_ = code;
}

void CardOutput::check() {
  if (!read_back_) return;
  const std::uint32_t told = converter_->read_back();
  if (told != written_) {
    throw DeviceError(converter_->name() + " was told code " + std::to_string(written_) + ", but reads back " +
                      std::to_string(told) + ". Does another program write to it?");
  }
}

void CardOutput::run() noexcept {
  double checked = machine_.now();
  bool ended = false;
  while (!ended) {
    bell_.wait(fault_ == Fault::none ? between_checks : retry_after);
    ended = quit_;
    busy_since_ = machine_.now();
    try {
      if (!open_) converter_->open(true);
      open_ = true;
      const bool anew = anew_.exchange(false) || fault_ != Fault::none;
      const std::uint32_t code = converter_->code(target_.volts());
      if (anew || code != written_) write(code);
      if (anew || machine_.now() - checked > between_checks) {
        check();
        checked = machine_.now();
      }
      fault_ = Fault::none;
    } catch (const std::exception&) {  // whatever it was: the card opened anew is the best that can be done
      fault_ = Fault::output_failed;
      anew_ = true;
      open_ = false;
      converter_->close();
    }
    busy_since_ = never;
  }
}

}  // namespace emtb
