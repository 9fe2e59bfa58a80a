#include "drivers/comedi/input.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>

namespace emtb::comedi {
namespace {

constexpr double longest_wait = 0.05;      // [s] until a wish to end is seen
constexpr double silence = 1;              // [s] without a sample, beyond ten scans
constexpr double rate_tolerance = 0.05;    // what a card's clock divider may make of the rate
constexpr double wake_each_scan_to = 5e3;  // [Hz] beyond, the card's usual blocks are quick enough
constexpr double nanoseconds = 1e9;        // in a second
constexpr int attempts = 4;                // a driver may adjust a command in several steps

/// Lets the driver adjust a command until it takes it. @return whether it does
bool settle(comedi_t* card, comedi_cmd& command) {
  for (int n = 0; n < attempts; ++n) {
    const int step = comedi_command_test(card, &command);
    if (step == 0) return true;
    if (step < 0) return false;
  }
  return false;
}

}  // namespace

void Inputs::open() {
  link_ = std::make_unique<Link>(settings_.card);
  plan_ = plan();
}

Inputs::Plan Inputs::plan() const {
  const Link& link = *link_;
  Plan made;
  made.subdevice = link.subdevice(COMEDI_SUBD_AI, "analog inputs");
  const unsigned int flags = link.flags(made.subdevice);
  if ((flags & SDF_CMD_READ) == 0) {
    throw DeviceError(link.name() + ": cannot scan by its own clock (its driver knows no commands)");
  }
  if (comedi_get_read_subdevice(link.get()) != static_cast<int>(made.subdevice) &&
      comedi_set_read_subdevice(link.get(), made.subdevice) < 0) {
    link.fail("its analog inputs");
  }
  made.width = (flags & SDF_LSAMPL) != 0 ? sizeof(lsampl_t) : sizeof(sampl_t);
  for (const InputChannel& channel : settings_.channels) {
    const std::size_t number = link.range_for(made.subdevice, channel.channel, channel.wanted);
    made.list.push_back(pack(channel.channel, number, channel.wiring));
    made.ranges.push_back(link.range(made.subdevice, channel.channel, number));
    made.converters.push_back(link.converter(made.subdevice, channel.channel, number));
    link.read(made.subdevice, channel.channel, number, channel.wiring);
  }

  const auto count = static_cast<unsigned int>(made.list.size());
  const auto period = static_cast<unsigned int>(std::lround(nanoseconds / settings_.rate));
  if (comedi_get_cmd_generic_timed(link.get(), made.subdevice, &made.command, count, period) < 0) {
    link.fail("a scan of " + std::to_string(count) + " channels");
  }
  made.command.chanlist = made.list.data();
  made.command.chanlist_len = count;
  made.command.stop_src = TRIG_NONE;
  made.command.stop_arg = 0;
  comedi_cmd eager = made.command;  // wakes us at the end of each scan, where the driver can
  eager.flags |= CMDF_WAKE_EOS;
  if (settings_.rate <= wake_each_scan_to && settle(link.get(), eager)) {
    made.command = eager;
  } else if (!settle(link.get(), made.command)) {
    throw DeviceError(link.name() +
                      ": takes no scan of these channels at this rate. Some cards want consecutive "
                      "channels, or one range for all");
  }
  const auto makes = scan_period(made.command, count);
  if (!makes || std::abs(*makes * settings_.rate - 1) > rate_tolerance) {
    throw DeviceError(link.name() + ": cannot scan " + std::to_string(count) + " channels at " +
                      std::to_string(std::lround(settings_.rate)) + " Hz" +
                      (makes ? ", only at " + std::to_string(std::lround(1 / *makes)) + " Hz" : "") +
                      ". Write another rate");
  }
  made.period = *makes;
  return made;
}

std::vector<Channel> Inputs::describe(const std::string& name) const {
  std::vector<Channel> descriptions;
  for (std::size_t k = 0; k < settings_.channels.size(); ++k) {
    const InputChannel& channel = settings_.channels[k];
    const Range& range = plan_.ranges[k];
    const double a = channel.scale * range.min + channel.offset;
    const double b = channel.scale * range.max + channel.offset;
    descriptions.push_back({.signal = channel.signal,
                            .period = plan_.period,
                            .window = 0,
                            .lsb = std::abs(b - a) / plan_.converters[k].top,
                            .source = name + " channel " + std::to_string(channel.channel),
                            .low = std::min(a, b),
                            .high = std::max(a, b),
                            .conversion = {.scale = channel.scale, .offset = channel.offset, .from_file = true}});
  }
  return descriptions;
}

void Inputs::run(Scan& scan) {
  const Link& link = *link_;
  comedi_cancel(link.get(), plan_.subdevice);  // a scan that broke may still run
  comedi_cmd command = plan_.command;
  command.chanlist = plan_.list.data();
  if (comedi_command(link.get(), &command) < 0) link.fail("starting a scan");
  const struct Cancel {
    const Link& link;
    unsigned int subdevice;
    ~Cancel() { comedi_cancel(link.get(), subdevice); }
  } at_the_end{link, plan_.subdevice};

  scan.began();
  double heard = machine_.now();
  std::array<std::uint8_t, 65536> buffer{};
  while (scan.wanted()) {
    std::array<pollfd, 1> ready{{{.fd = link.descriptor(), .events = POLLIN, .revents = 0}}};
    poll(ready.data(), ready.size(), static_cast<int>(longest_wait * 1e3));
    const bool woken = ready[0].revents != 0;
    const ssize_t got = woken ? ::read(link.descriptor(), buffer.data(), buffer.size()) : -1;
    if (!woken || (got < 0 && (errno == EAGAIN || errno == EINTR))) {
      if (machine_.now() - heard > silence + 10 * plan_.period) throw ScanBroken{Fault::scan_broken};
      continue;
    }
    if (got < 0) {
      if (errno == EPIPE || errno == EOVERFLOW) throw ScanBroken{Fault::samples_lost};
      throw Gone(link.name() + ": has gone");
    }
    if (got == 0) throw ScanBroken{Fault::scan_broken};  // the command has ended, though it was to have no end
    heard = machine_.now();
    scan.take(std::span(buffer).first(static_cast<std::size_t>(got)),
              [this](std::size_t channel, std::uint32_t code) { return volts(channel, code); });
  }
}

std::optional<double> Inputs::volts(std::size_t channel, std::uint32_t code) const noexcept {
  const Converter& converter = plan_.converters[channel];
  if (converter.saturated(code)) return std::nullopt;
  return converter.volts(code);
}

}  // namespace emtb::comedi
