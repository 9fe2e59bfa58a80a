#include "drivers/comedi/output.h"

#include <algorithm>
#include <cmath>

namespace emtb::comedi {
namespace {

constexpr double between_checks = 0.25;  // [s]
constexpr double retry_after = 0.1;      // [s] between attempts to reach a card that does not answer
constexpr double longest_request = 0.2;  // [s] a register takes microseconds; a busy machine adds some tens of ms

}  // namespace

Output::Output(std::string name, OutputSettings settings)
    : name_(std::move(name)), settings_(std::move(settings)), wanted_(settings_.limits.safe) {
  try {
    open();
    write(settings_.limits.safe);
    check();
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
  link_ = std::make_unique<Link>(settings_.card);
  subdevice_ = link_->subdevice(COMEDI_SUBD_AO, "analog output");
  range_ = link_->range_for(subdevice_, settings_.channel, {settings_.limits.min, settings_.limits.max});
  converter_ = link_->converter(subdevice_, settings_.channel, range_);
}

void Output::write(double volts) {
  const lsampl_t code = converter_.code(volts);
  link_->write(subdevice_, settings_.channel, range_, code);
  written_ = code;
}

void Output::check() {
  if (!settings_.read_back) return;
  lsampl_t told = 0;
  try {
    told = link_->read(subdevice_, settings_.channel, range_, Wiring::single_ended);
  } catch (const Gone&) {
    throw;
  } catch (const DeviceError& e) {
    throw DeviceError(std::string(e.what()) + ". If it cannot be read back, write read_back: false under reference");
  }
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
      if (anew || converter_.code(volts) != written_) write(volts);
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

}  // namespace emtb::comedi
