#include "drivers/usb1608g/input.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "drivers/usb1608g/transfers.h"

namespace emtb::usb1608g {
namespace {

constexpr double longest_pump = 0.05;  // [s] until a wish to end is seen
constexpr double quiet = 0.1;          // [s] without a sample, after which the card is asked why
constexpr double silence = 1;          // [s] without a sample from a card that says it is well
constexpr double in_flight = 0.1;      // [s] of samples that transfers under way can hold
constexpr std::size_t fewest = 8;      // transfers under way
constexpr std::size_t most = 64;

std::vector<Slot> slots_of(const std::vector<InputChannel>& channels) {
  std::vector<Slot> list;
  for (const InputChannel& channel : channels) list.push_back(channel.slot);
  return list;
}

}  // namespace

Inputs::Inputs(InputSettings settings)
    : settings_(std::move(settings)),
      pacer_period_(pacer_period(settings_.rate, settings_.channels.size(), settings_.pacer)),
      period_(1 / scan_rate(pacer_period_, settings_.channels.size(), settings_.pacer)) {}

void Inputs::open() {
  link_ = std::make_unique<Link>(settings_.card.serial, Access::requests_and_scan);
  settings_.card.serial = link_->serial();  // whatever else is plugged in later: this one
  configure_fpga(*link_, settings_.card.fpga);
  link_->send(Request::scan_stop);  // whoever was here before may have left one running
  calibration_ = read_calibration(*link_, settings_.card.calibrated);
  for (const InputChannel& channel : settings_.channels) read_once(*link_, channel.slot);
}

std::vector<Channel> Inputs::describe(const std::string& name) const {
  std::vector<Channel> descriptions;
  for (const InputChannel& channel : settings_.channels) {
    const double full_scale = ranges[static_cast<std::size_t>(channel.slot.range)];
    const double reach = std::abs(channel.scale) * full_scale;
    descriptions.push_back({.signal = channel.signal,
                            .period = period_,
                            .window = 0,
                            .lsb = std::abs(channel.scale) * 2 * full_scale / codes,
                            .source = name + " channel " + std::to_string(channel.slot.channel),
                            .low = channel.offset - reach,
                            .high = channel.offset + reach,
                            .conversion = {.scale = channel.scale, .offset = channel.offset, .from_file = true}});
  }
  return descriptions;
}

void Inputs::run(Scan& scan) {
  Link& link = *link_;
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

  double heard = machine_.now();
  bool torn = false;
  Transfers transfers(link, count, packing.transfer, [&](std::span<const std::uint8_t> bytes) {
    torn = torn || bytes.size() % (packing.whole_scans ? 2 * channels : 2) != 0;
    if (torn) return;
    heard = machine_.now();
    scan.take(bytes, [this](std::size_t channel, std::uint32_t code) { return volts(channel, code); });
  });
  link.send(Request::scan_start, 0, 0,
            scan_start({.period = pacer_period_, .packet = packing.packet, .length = settings_.start_length}));
  scan.began();

  const double patience = std::max(quiet, 3 * per_transfer);
  double asked = 0;
  while (scan.wanted()) {
    link.pump(longest_pump);
    if (torn || transfers.ended() == LIBUSB_TRANSFER_STALL || transfers.ended() == LIBUSB_TRANSFER_OVERFLOW) {
      throw ScanBroken{Fault::scan_broken};
    }
    if (transfers.ended() != LIBUSB_TRANSFER_COMPLETED) throw Gone(link.name() + ": has gone");
    const double now = machine_.now();
    if (now - heard < patience || now - asked < quiet) continue;
    asked = now;
    if (const Fault why = diagnose(); why != Fault::none) throw ScanBroken{why};
    if (now - heard > silence + patience) throw ScanBroken{Fault::scan_broken};
  }
  link.send(Request::scan_stop);
}

Fault Inputs::diagnose() {
  const std::uint16_t status = link_->status();
  if ((status & status_bit::fpga_configured) == 0) throw Gone(link_->name() + ": has lost its FPGA image");
  if ((status & status_bit::scan_overrun) != 0) return Fault::samples_lost;
  if ((status & status_bit::scan_running) == 0) return Fault::scan_broken;
  return Fault::none;
}

std::optional<double> Inputs::volts(std::size_t channel, std::uint32_t code) const noexcept {
  const auto word = static_cast<std::uint16_t>(code);
  if (saturated(word)) return std::nullopt;
  const auto range = static_cast<std::size_t>(settings_.channels[channel].slot.range);
  return volts_of(word, calibration_.inputs[range], ranges[range]);
}

}  // namespace emtb::usb1608g
