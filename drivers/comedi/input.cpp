#include "drivers/comedi/input.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>

namespace emtb::comedi {
namespace {

constexpr double reopen_after = 0.5;       // [s] between attempts to open a card that has gone
constexpr double idle = 10;                // [s] of one wait without a scan
constexpr double longest_wait = 0.05;      // [s] until a wish to end is seen
constexpr double silence = 1;              // [s] without a sample, beyond ten scans
constexpr double rate_tolerance = 0.05;    // what a card's clock divider may make of the rate
constexpr double wake_each_scan_to = 5e3;  // [Hz] beyond, the card's usual blocks are quick enough
constexpr double loop_away = 0.5;          // [s] that the loop may be away before readings are lost
constexpr double nanoseconds = 1e9;        // in a second
constexpr int attempts = 4;                // a driver may adjust a command in several steps

/// A scan that must begin anew.
struct Broken {
  Fault fault;
};

std::size_t capacity(const InputSettings& settings) {
  const double readings = settings.rate * static_cast<double>(settings.channels.size()) * loop_away;
  return static_cast<std::size_t>(std::clamp(readings, 1024.0, 1e6));
}

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

Input::Input(std::string name, std::shared_ptr<Clock> clock, InputSettings settings)
    : name_(std::move(name)),
      clock_(std::move(clock)),
      settings_(std::move(settings)),
      opened_([this] {
        try {
          return std::make_unique<Link>(settings_.card);
        } catch (const DeviceError& e) {
          throw DeviceError(name_ + ": " + e.what());
        }
      }()),
      plan_([this] {
        try {
          return plan(*opened_);
        } catch (const DeviceError& e) {
          throw DeviceError(name_ + ": " + e.what());
        }
      }()),
      descriptions_(describe()),
      handover_(descriptions_, capacity(settings_)) {
  thread_ = std::thread([this, link = std::move(opened_)]() mutable { run(std::move(link)); });
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

Input::Plan Input::plan(const Link& link) const {
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

std::vector<Channel> Input::describe() const {
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
                            .source = name_ + " channel " + std::to_string(channel.channel),
                            .low = std::min(a, b),
                            .high = std::max(a, b),
                            .conversion = {.scale = channel.scale, .offset = channel.offset, .from_file = true}});
  }
  return descriptions;
}

void Input::run(std::unique_ptr<Link> link) noexcept {
  while (!quit_) {
    if (!wanted_) {
      bell_.wait(idle);
      continue;
    }
    try {
      if (!link) {
        link = std::make_unique<Link>(settings_.card);
        plan_.converters = plan(*link).converters;
      }
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

void Input::scan(const Link& link) {
  comedi_cancel(link.get(), plan_.subdevice);  // a scan that broke may still run
  comedi_cmd command = plan_.command;
  command.chanlist = plan_.list.data();
  if (comedi_command(link.get(), &command) < 0) link.fail("starting a scan");
  const struct Cancel {
    const Link& link;
    unsigned int subdevice;
    ~Cancel() { comedi_cancel(link.get(), subdevice); }
  } at_the_end{link, plan_.subdevice};

  ScanAssembler assembler(plan_.list.size(), plan_.width);
  SampleClock samples(plan_.period);
  samples.arrived(0, clock_->now());
  std::uint64_t scans = 0;
  double heard = machine_.now();
  std::array<std::uint8_t, 65536> buffer{};
  while (!quit_) {
    std::array<pollfd, 1> ready{{{.fd = link.descriptor(), .events = POLLIN, .revents = 0}}};
    poll(ready.data(), ready.size(), static_cast<int>(longest_wait * 1e3));
    if (machine_.now() - heard > silence + 10 * plan_.period) throw Broken{Fault::scan_broken};
    if (ready[0].revents == 0) continue;
    const ssize_t got = ::read(link.descriptor(), buffer.data(), buffer.size());
    if (got < 0) {
      if (errno == EAGAIN || errno == EINTR) continue;
      if (errno == EPIPE || errno == EOVERFLOW) throw Broken{Fault::samples_lost};
      throw Gone(link.name() + ": has gone");
    }
    if (got == 0) throw Broken{Fault::scan_broken};  // the command has ended, though it was to have no end
    heard = machine_.now();
    const std::span bytes(buffer.data(), static_cast<std::size_t>(got));
    const std::uint64_t complete = scans + assembler.scans_in(bytes.size());
    if (complete > scans) samples.arrived(complete - 1, clock_->now());
    clock_report_.store(samples.estimate());
    assembler.feed(bytes, [&](std::span<const lsampl_t> codes) { deliver(codes, samples.time_of(scans++)); });
  }
}

void Input::deliver(std::span<const lsampl_t> codes, double time) noexcept {
  bool clipped = false;
  for (std::size_t k = 0; k < codes.size(); ++k) {
    if (plan_.converters[k].saturated(codes[k])) {
      clipped = true;
      continue;
    }
    const InputChannel& channel = settings_.channels[k];
    handover_.deliver(channel.signal, time, channel.scale * plan_.converters[k].volts(codes[k]) + channel.offset);
  }
  if (clipped) {
    handover_.raise(Fault::over_range);
  } else {
    handover_.clear();
  }
}

}  // namespace emtb::comedi
