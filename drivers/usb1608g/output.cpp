#include "drivers/usb1608g/output.h"

#include <algorithm>
#include <cmath>

namespace emtb::usb1608g {
namespace {

constexpr double between_checks = 0.25;  // [s]
constexpr double retry_after = 0.1;      // [s] between attempts to reach a card that does not answer
constexpr double longest_request = 0.2;  // [s] a request takes 0.3 ms; a busy machine adds some tens

}  // namespace

Output::Output(std::string name, OutputSettings settings)
    : name_(std::move(name)), settings_(std::move(settings)), wanted_(settings_.limits.safe) {
  try {
    open();
    write(settings_.limits.safe);
    check();
  } catch (const Stalled& e) {
    throw DeviceError(name_ + ": " + e.what() + ". If it cannot be read back, write read_back: false under reference");
  } catch (const DeviceError& e) {
    throw DeviceError(name_ + ": " + e.what());
  }
  thread_ = std::thread([this] { run(); });
}

Output::~Output() {
  make_safe();
  quit_ = true;
  bell_.ring();
  thread_.join();
}

Fault Output::set(double volts) noexcept {
  if (!std::isfinite(volts)) {
    make_safe();
    return Fault::non_finite;
  }
  const double within = std::clamp(volts, settings_.limits.min, settings_.limits.max);
  if (wanted_.exchange(within) != within) bell_.ring();
  return verdict();
}

Fault Output::make_safe() noexcept {
  wanted_ = settings_.limits.safe;
  anew_ = true;
  bell_.ring();
  return verdict();
}

Fault Output::verdict() const noexcept {
  return machine_.now() - busy_since_ > longest_request ? Fault::output_failed : fault_.load();
}

void Output::open() {
  link_ = std::make_unique<Link>(settings_.card.serial, Access::requests);
  settings_.card.serial = link_->serial();
  const Model& model = link_->model();
  if (settings_.channel >= model.outputs) {
    throw DeviceError(link_->name() + ": has no analog output " + std::to_string(settings_.channel) +
                      (model.outputs > 0 ? ". It has 0 and 1" : ". Only the -2AO has any"));
  }
  if (thread_.joinable()) {  // two that load an image at a time would spoil it: the input does
    if ((link_->status() & status_bit::fpga_configured) == 0) throw DeviceError(link_->name() + ": has no FPGA image");
  } else {
    configure_fpga(*link_, settings_.card.fpga);
  }
  correction_ =
      read_calibration(*link_, settings_.card.calibrated).outputs[static_cast<std::size_t>(settings_.channel)];
}

void Output::write(double volts) {
  const std::uint16_t code = code_of(volts, correction_);
  link_->send(Request::aout, code, static_cast<std::uint16_t>(settings_.channel));
  written_ = code;
}

void Output::check() {
  if (!settings_.read_back) return;
  const std::uint16_t told = read_back(*link_, settings_.channel);
  if (told != written_) {
    throw DeviceError(link_->name() + ": output " + std::to_string(settings_.channel) + " was told code " +
                      std::to_string(written_) + ", but reads back " + std::to_string(told) +
                      ". Does another program write to it?");
  }
}

void Output::run() noexcept {
  double checked = machine_.now();
  bool ended = false;
  while (!ended) {
    bell_.wait(fault_ == Fault::none ? between_checks : retry_after);
    ended = quit_;
    busy_since_ = machine_.now();
    try {
      if (!link_) open();
      const bool anew = anew_.exchange(false) || fault_ != Fault::none;
      const double volts = wanted_;
      if (anew || code_of(volts, correction_) != written_) write(volts);
      if (anew || machine_.now() - checked > between_checks) {
        check();
        checked = machine_.now();
      }
      fault_ = Fault::none;
    } catch (const std::exception&) {  // whatever it was: a new link is the best that can be done
      fault_ = Fault::output_failed;
      anew_ = true;
      link_.reset();
    }
    busy_since_ = never;
  }
}

}  // namespace emtb::usb1608g
