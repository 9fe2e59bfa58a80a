#include "drivers/usb1608g/input.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "drivers/usb1608g/transfers.h"

namespace emtb::usb1608g {
namespace {

constexpr double reopen_after = 0.5;   // [s] between attempts to open a card that has gone
constexpr double idle = 10;            // [s] of one wait without a scan
constexpr double longest_pump = 0.05;  // [s] until a wish to end is seen
constexpr double quiet = 0.1;          // [s] without a sample, after which the card is asked why
constexpr double silence = 1;          // [s] without a sample from a card that says it is well
constexpr double in_flight = 0.1;      // [s] of samples that transfers under way can hold
constexpr std::size_t fewest = 8;      // transfers under way
constexpr std::size_t most = 64;
constexpr double loop_away = 0.5;  // [s] that the loop may be away before readings are lost

/// A scan that must begin anew.
struct Broken {
  Fault fault;
};

std::vector<Slot> slots_of(const std::vector<InputChannel>& channels) {
  std::vector<Slot> list;
  for (const InputChannel& channel : channels) list.push_back(channel.slot);
  return list;
}

std::vector<Channel> describe(const std::string& name, const InputSettings& settings, double period) {
  std::vector<Channel> descriptions;
  for (const InputChannel& channel : settings.channels) {
    const double full_scale = ranges[static_cast<std::size_t>(channel.slot.range)];
    const double reach = std::abs(channel.scale) * full_scale;
    descriptions.push_back({.signal = channel.signal,
                            .period = period,
                            .window = 0,
                            .lsb = std::abs(channel.scale) * 2 * full_scale / codes,
                            .source = name + " channel " + std::to_string(channel.slot.channel),
                            .low = channel.offset - reach,
                            .high = channel.offset + reach,
                            .conversion = {.scale = channel.scale, .offset = channel.offset, .from_file = true}});
  }
  return descriptions;
}

std::size_t capacity(const InputSettings& settings) {
  const double readings = settings.rate * static_cast<double>(settings.channels.size()) * loop_away;
  return static_cast<std::size_t>(std::clamp(readings, 1024.0, 1e6));
}

}  // namespace

Input::Input(std::string name, std::shared_ptr<Clock> clock, InputSettings settings)
    : name_(std::move(name)),
      clock_(std::move(clock)),
      settings_(std::move(settings)),
      pacer_period_(pacer_period(settings_.rate, settings_.channels.size(), settings_.pacer)),
      period_(1 / scan_rate(pacer_period_, settings_.channels.size(), settings_.pacer)),
      descriptions_(describe(name_, settings_, period_)),
      handover_(descriptions_, capacity(settings_)) {
  std::unique_ptr<Link> link;
  try {
    link = open();
    for (const InputChannel& channel : settings_.channels) read_once(*link, channel.slot);
  } catch (const DeviceError& e) {
    throw DeviceError(name_ + ": " + e.what());
  }
  thread_ = std::thread([this, opened = std::move(link)]() mutable { run(std::move(opened)); });
}

Input::~Input() {
  quit_ = true;
  bell_.ring();
  thread_.join();
}

void Input::start() {
  handover_.restart();
  wanted_ = true;
  bell_.ring();
}

std::unique_ptr<Link> Input::open() {
  auto link = std::make_unique<Link>(settings_.card.serial, Access::requests_and_scan);
  settings_.card.serial = link->serial();  // whatever else is plugged in later: this one
  configure_fpga(*link, settings_.card.fpga);
  link->send(Request::scan_stop);  // whoever was here before may have left one running
  calibration_ = read_calibration(*link, settings_.card.calibrated);
  return link;
}

void Input::run(std::unique_ptr<Link> link) noexcept {
  while (!quit_) {
    if (!wanted_) {
      bell_.wait(idle);
      continue;
    }
    try {
      if (!link) link = open();
      scan(*link);
    } catch (const Broken& broken) {
      handover_.raise(broken.fault);
    } catch (const std::exception&) {  // it has gone, or is not back yet
      link.reset();
      handover_.raise(Fault::device_lost);
      bell_.wait(reopen_after);
    }
  }
}

void Input::scan(Link& link) {
  const std::size_t channels = settings_.channels.size();
  const Packing packing = pack(1 / period_, channels, settings_.latency, link.packet_size());
  const double per_transfer =
      period_ * static_cast<double>(packing.whole_scans ? packing.packet : static_cast<int>(packing.transfer / 2)) /
      static_cast<double>(channels);
  const auto count = std::clamp(static_cast<std::size_t>(in_flight / per_transfer), fewest, most);

  link.send(Request::scan_stop);
  link.send(Request::scan_list, 0, 0, scan_list(slots_of(settings_.channels)));
  link.clear_halt();
  link.send(Request::scan_clear);

  ScanDecoder decoder(channels);
  SampleClock samples(period_);
  std::uint64_t scans = 0;
  double heard = machine_.now();
  bool torn = false;
  Transfers transfers(link, count, packing.transfer, [&](std::span<const std::uint8_t> bytes) {
    torn = torn || bytes.size() % (packing.whole_scans ? 2 * channels : 2) != 0;
    if (torn) return;
    heard = machine_.now();
    const std::uint64_t complete = scans + bytes.size() / (2 * channels);
    if (complete > scans) samples.arrived(complete - 1, clock_->now());
    clock_report_.store(samples.estimate());
    decoder.feed(bytes, [&](std::span<const std::uint16_t> scan_codes) {
      deliver(scan_codes, samples.time_of(scans));
      ++scans;
    });
  });
  link.send(Request::scan_start, 0, 0,
            scan_start({.period = pacer_period_, .packet = packing.packet, .length = settings_.start_length}));
  samples.arrived(0, clock_->now());

  const double patience = std::max(quiet, 3 * per_transfer);
  double asked = 0;
  while (!quit_) {
    link.pump(longest_pump);
    if (torn || transfers.ended() == LIBUSB_TRANSFER_STALL || transfers.ended() == LIBUSB_TRANSFER_OVERFLOW) {
      throw Broken{Fault::scan_broken};
    }
    if (transfers.ended() != LIBUSB_TRANSFER_COMPLETED) throw Gone(link.name() + ": has gone");
    const double now = machine_.now();
    if (now - heard < patience || now - asked < quiet) continue;
    asked = now;
    if (const Fault why = diagnose(link); why != Fault::none) throw Broken{why};
    if (now - heard > silence + patience) throw Broken{Fault::scan_broken};
  }
  link.send(Request::scan_stop);
}

Fault Input::diagnose(Link& link) const {
  const std::uint16_t status = link.status();
  if ((status & status_bit::fpga_configured) == 0) throw Gone(link.name() + ": has lost its FPGA image");
  if ((status & status_bit::scan_overrun) != 0) return Fault::samples_lost;
  if ((status & status_bit::scan_running) == 0) return Fault::scan_broken;
  return Fault::none;
}

void Input::deliver(std::span<const std::uint16_t> scan_codes, double time) noexcept {
  bool clipped = false;
  for (std::size_t k = 0; k < scan_codes.size(); ++k) {
    const InputChannel& channel = settings_.channels[k];
    if (saturated(scan_codes[k])) {
      clipped = true;
      continue;
    }
    const auto range = static_cast<std::size_t>(channel.slot.range);
    const double volts = volts_of(scan_codes[k], calibration_.inputs[range], ranges[range]);
    handover_.deliver(channel.signal, time, channel.scale * volts + channel.offset);
  }
  if (clipped) {
    handover_.raise(Fault::over_range);
  } else {
    handover_.clear();
  }
}

}  // namespace emtb::usb1608g
