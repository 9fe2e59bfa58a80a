#include "drivers/program/device.h"

#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "hal/error.h"
#include "hal/one_line.h"

namespace emtb::program {
namespace {

constexpr double restart_after = 1;        // [s] between the end of a process and the start of the next
constexpr double restart_soon = 0.05;      // [s] the same, of one that had been well: an output waits to be made safe
constexpr double well_after = 5;           // [s] of life
constexpr double breath = 0.002;           // [s] between two `set` at the earliest
constexpr double farewell = 0.2;           // [s] that a program that moves has to say that it is safe
constexpr double last_words = 0.2;         // [s] after the end of its stdout, for the status
constexpr double look_at_broken = 1;       // [s]
constexpr std::uint64_t many = 20;         // lines that mean nothing within that
constexpr double complain_again = 10;      // [s]
constexpr double loop_away = 0.5;          // [s] that the loop may be away before readings are lost
constexpr double near = 0.01;              // of the output's range: as close as it has to be to what it was told
constexpr double hurry = 1e-3;             // [s] by which a time may be ahead: clocks are read one after the other
constexpr std::size_t longest_word = 200;  // [bytes] of its stderr that are kept

double lines_per_second(const ProgramSettings& settings) {
  double lines = 0;
  for (const ProgramChannel& channel : settings.channels) lines += 1 / channel.period;
  return lines;
}

/// As many lines as there are readings, one a value, twice over, and an answer to each `set`.
std::size_t most_lines(const ProgramSettings& settings) {
  return static_cast<std::size_t>(2 * (lines_per_second(settings) + 1 / breath));
}

std::vector<Channel> described(const std::string& name, const ProgramSettings& settings) {
  std::vector<Channel> channels;
  for (const ProgramChannel& channel : settings.channels) {
    channels.push_back({.signal = channel.signal,
                        .period = channel.period,
                        .window = channel.window,
                        .lsb = channel.scaling.digit,
                        .source = name + " (program " + settings.child.command[0] + ")",
                        .conversion = channel.scaling.conversion("as the program says it")});
    if (channel.scaling.range > 0) channels.back().low = -(channels.back().high = channel.scaling.range);
  }
  return channels;
}

}  // namespace

/// Whatever ends the talk: an output is told to be safe before its process is killed.
struct Device::Farewell {
  Device& device;
  Talk& with;
  ~Farewell() {
    if (device.settings_.moves) device.say_farewell(with);
  }
};

struct Device::Talk {
  Talk(const ChildSettings& settings, std::size_t lines, double now)
      : child(settings), feed(lines), started(now), heard(now), followed(now), looked(now) {}

  Child child;
  LineFeed feed;
  double started, heard, followed, looked;  ///< [s] its start; last line; output as told; look at what is broken
  std::optional<Hello> hello{};
  bool mute = false;         ///< it has closed its stderr
  bool answered = true;      ///< it has said what its output is at since it was told the last value
  bool at_work = false;      ///< it measures, and its output is safe
  std::uint64_t broken = 0;  ///< lines that mean nothing, since the last look
  std::string nonsense{}, complaint{};
  std::array<double, signal_count> last{};       ///< [s] time of the last reading
  std::deque<std::pair<double, double>> told{};  ///< when, what [V]: of the last while
};

Device::Device(std::string name, std::shared_ptr<Clock> clock, ProgramSettings settings)
    : name_(std::move(name)),
      clock_(std::move(clock)),
      settings_(std::move(settings)),
      descriptions_(described(name_, settings_)),
      handover_(descriptions_, static_cast<std::size_t>(std::max(256.0, loop_away * lines_per_second(settings_)))),
      target_(settings_.moves.value_or(Limits{}), bell_) {
  auto opened = opened_.get_future();
  thread_ = std::thread([this] { run(); });
  if (const std::string why = opened.get(); !why.empty()) {
    thread_.join();
    throw DeviceError(name_ + ": " + why);
  }
}

Device::~Device() {
  make_safe();
  quit_ = true;
  bell_.ring();
  thread_.join();
}

Fault Device::set(double volts) noexcept {
  if (!target_.set(volts)) {
    make_safe();
    return Fault::non_finite;
  }
  return dropped_ ? Fault::output_failed : output_.load();
}

Fault Device::make_safe() noexcept {
  dropped_ = false;
  target_.make_safe();
  return output_;
}

void Device::run() noexcept {
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, nullptr);  // SIGPIPE, too: a write to one that has died is an error like others
  while (!quit_) {
    const double began = machine_.now();
    try {
      Talk with(settings_.child, most_lines(settings_), began);
      const Farewell farewell{*this, with};
      pid_ = with.child.pid();
      talk(with);
    } catch (const std::exception& e) {
      give_up();
      pid_ = 0;
      if (waited_for_) return opened_.set_value(e.what());
      const double now = machine_.now();
      if (now - complained_ > complain_again) {
        std::fprintf(stderr, "%s: lost: %s\n", name_.c_str(), in_one_line(e.what()).c_str());
        complained_ = now;
      }
      const double until = now + (now - began > well_after ? restart_soon : restart_after);
      while (!quit_ && machine_.now() < until) bell_.wait(until - machine_.now());
    }
  }
}

void Device::talk(Talk& with) {
  std::array<char, 4096> buffer{};
  if (!with.child.say(greeting)) lost(with, "does not take its first line");
  while (!quit_) {
    const double due = command(with);
    std::array<pollfd, 3> ready{{{.fd = with.child.out(), .events = POLLIN, .revents = 0},
                                 {.fd = with.mute ? -1 : with.child.complaints(), .events = POLLIN, .revents = 0},
                                 {.fd = bell_.descriptor(), .events = POLLIN, .revents = 0}}};
    ::poll(ready.data(), ready.size(), static_cast<int>(std::ceil(std::clamp(due, 0.0, alive) * 1e3)));
    if (ready[1].revents != 0) {
      const ssize_t got = ::read(with.child.complaints(), buffer.data(), buffer.size());
      with.mute = got <= 0;
      if (got > 0) with.complaint.append(buffer.data(), static_cast<std::size_t>(got));
      if (with.complaint.size() > longest_word) with.complaint.erase(0, with.complaint.size() - longest_word);
    }
    if (ready[0].revents != 0) {
      const ssize_t got = ::read(with.child.out(), buffer.data(), buffer.size());
      if (got == 0) lost(with, "has closed its stdout");
      const std::string_view bytes(buffer.data(), got > 0 ? static_cast<std::size_t>(got) : 0);
      if (!with.feed.feed(bytes, machine_.now(), [&](const LineFeed::Line& line) { hear(with, line); })) {
        lost(with, "says more than " + std::to_string(most_lines(settings_)) + " lines a second");
      }
    }
    look_after(with);
  }
}

void Device::give_up() noexcept {
  output_ = Fault::output_failed;
  handover_.raise(Fault::device_lost);
}

void Device::lost(Talk& with, const std::string& why) {
  give_up();
  const double wait = why.ends_with("stdout") ? last_words : 0;
  std::string text = settings_.child.command[0] + ": " + with.child.ended(wait).value_or(why);
  std::string said = with.complaint;
  while (said.ends_with('\n')) said.pop_back();
  said = said.substr(said.rfind('\n') + 1);  // the last line: of a Python trace, what it was
  if (!said.empty()) text += ": " + said;
  if (said.empty() && !with.nonsense.empty()) text += "; it said `" + with.nonsense + "`";
  throw DeviceError(in_one_line(text));
}

void Device::hear(Talk& with, const LineFeed::Line& line) {
  const double now = machine_.now();
  if (!with.hello) {
    with.hello = line.too_long ? std::nullopt : read_hello(line.text);
    if (with.hello && with.hello->version != protocol_version) {
      lost(with, "speaks version " + std::to_string(with.hello->version) + " of the protocol, emtb version " +
                     std::to_string(protocol_version));
    }
    if (with.hello) {
      with.heard = with.followed = now;
      if (!settings_.moves) ready(with);
      return;
    }
  } else if (!line.too_long) {
    if (const auto fault = read_fault(line.text)) {
      handover_.raise(*fault);
      with.heard = now;
      return;
    }
    const auto report = read_report(line.text);
    if (report && deliver(with, *report)) {
      with.heard = now;
      return;
    }
  }
  ++with.broken;
  with.nonsense = line.text.substr(0, 60);
}

/// @return false where its time or one of its signals cannot be: nothing of it counts
bool Device::deliver(Talk& with, const Report& report) {
  const double now = clock_->now();
  struct Ready {
    Signal signal{};
    double time = 0, value = 0;
  };
  std::array<Ready, signal_count> values{};
  if (report.time && *report.time > now + hurry) return false;
  bool finite = true;
  std::size_t count = 0;
  for (std::size_t k = 0; k < report.count; ++k) {
    const Value& said = report.values[k];
    const auto channel = std::ranges::find(settings_.channels, said.signal, &ProgramChannel::signal);
    if (channel == settings_.channels.end()) continue;  // it offers more than the bench file takes
    const double time = std::min(report.time.value_or(now), now) - channel->latency;
    if (time <= with.last[index(said.signal)]) return false;
    finite = finite && std::isfinite(said.value);
    values[count++] = {said.signal, time, channel->scaling.scale * said.value + channel->scaling.offset};
  }
  if (report.out && settings_.moves) follow_output(with, *report.out);
  if (!finite) {
    handover_.raise(Fault::non_finite);
    return true;
  }
  if (count > 0) handover_.clear();
  for (std::size_t k = 0; k < count; ++k) {
    with.last[index(values[k].signal)] = values[k].time;
    handover_.deliver(values[k].signal, values[k].time, values[k].value);
  }
  return true;
}

/// What the program says its output is at: one of the values that it was told of late?
void Device::follow_output(Talk& with, double volts) {
  const double now = machine_.now();
  with.answered = true;
  const double close = near * (settings_.moves->max - settings_.moves->min);
  const bool follows =
      std::ranges::any_of(with.told, [&](const auto& told) { return std::abs(told.second - volts) <= close; });
  if (!follows) return;
  with.followed = now;
  output_ = Fault::none;
  if (std::abs(volts - target_.limits().safe) <= close) ready(with);
}

void Device::ready(Talk& with) {
  with.at_work = true;
  if (std::exchange(waited_for_, false)) opened_.set_value("");
}

void Device::look_after(Talk& with) {
  const double now = machine_.now();
  if (!with.at_work) {
    if (settings_.moves && with.hello && now - with.started > settings_.start_up) {
      lost(with, "does not say `out=` with the safe value that it was told");
    }
    if (now - with.started > settings_.start_up) lost(with, "does not say hello: `emtb 1 NAME`");
    return;
  }
  if (now - with.heard > settings_.silence) lost(with, "is silent");
  if (settings_.moves && now - with.followed > follow) {
    output_ = Fault::output_failed;
    dropped_ = true;
  }
  if (now - with.looked > look_at_broken) {
    if (with.broken > many) handover_.raise(Fault::scan_broken);
    with.broken = 0;
    with.looked = now;
  }
}

double Device::command(Talk& with) {
  bell_.answer();  // before the look at what is wanted: what changes after it rings anew
  if (!settings_.moves || !with.hello) return alive;
  const double safe = target_.limits().safe, now = machine_.now();
  // We hung, and its watchdog has bitten: it must not go on by itself as if nothing had been.
  if (!with.told.empty() && with.told.back().second != safe && now - with.told.back().first > watchdog) dropped_ = true;
  const double volts = with.at_work && !dropped_ ? target_.volts() : safe;
  if (!with.told.empty()) {
    const auto [when, what] = with.told.back();
    // No faster than it answers: a slow program must not work through old values. Safe waits for no answer.
    const bool at_once = volts != what && (with.answered || volts == safe);
    if (const double wait = when + (at_once ? breath : alive) - now; wait > 0) return wait;
  }
  while (with.told.size() > 1 && now - with.told.front().first > follow) with.told.pop_front();
  if (!with.child.say(set_line(volts))) lost(with, "does not read what it is told");
  with.told.emplace_back(now, volts);
  with.answered = false;
  return alive;
}

/// The output is made safe, and the program ends by itself, if it hurries.
void Device::say_farewell(Talk& with) noexcept {
  try {
    with.child.say(set_line(target_.limits().safe));
    with.child.hang_up();  // the end of its stdin: be safe, and end
    with.child.ended(farewell);
  } catch (const std::exception&) {  // no memory for that line: the end of its stdin says the same
  }
}

}  // namespace emtb::program
