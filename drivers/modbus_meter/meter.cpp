#include "drivers/modbus_meter/meter.h"

#include <array>
#include <cmath>

#include "hal/error.h"

namespace emtb::modbus_meter {
namespace {

constexpr double retry = 0.5;        // [s] between attempts to reach a meter that has gone
constexpr int attempts = 3;          // before a meter counts as absent
constexpr double rest_timeouts = 4;  // of silence on a serial line, after a failure

std::vector<Channel> described(const std::string& name, const MeterSettings& settings) {
  std::vector<Channel> channels;
  for (const Register& entry : settings.registers) {
    channels.push_back({.signal = entry.signal,
                        .period = settings.period,
                        .window = entry.window,
                        .lsb = entry.scaling.digit,
                        .source = name + " (Modbus " + name_of(settings.address) + " unit " +
                                  std::to_string(settings.unit) + ", function " + std::to_string(entry.function) +
                                  ", register " + std::to_string(entry.address) + ")",
                        .conversion = entry.scaling.conversion("of the register")});
    if (entry.scaling.range > 0) channels.back().low = -(channels.back().high = entry.scaling.range);
  }
  return channels;
}

}  // namespace

Meter::Meter(std::string name, std::shared_ptr<Clock> clock, MeterSettings settings)
    : name_(std::move(name)),
      clock_(std::move(clock)),
      settings_(std::move(settings)),
      descriptions_(described(name_, settings_)),
      handover_(descriptions_) {
  auto link = std::make_unique<Link>(settings_.address, settings_.unit, settings_.timeout);
  try_each_register(*link);
  thread_ = std::thread([this, open = std::move(link)]() mutable { run(std::move(open)); });
}

Meter::~Meter() {
  quit_.wish();
  thread_.join();
}

void Meter::try_each_register(Link& link) {
  for (const Register& entry : settings_.registers) {
    std::array<std::uint16_t, 2> words{};
    Outcome outcome = Outcome::silent;
    for (int n = 0; n < attempts && outcome != Outcome::ok && outcome != Outcome::refused; ++n) {
      if (n > 0) recover(link);
      outcome = link.read(entry.function, entry.address,
                          std::span(words).first(static_cast<std::size_t>(words_of(entry.type))));
    }
    if (outcome == Outcome::ok) continue;
    throw DeviceError(
        name_ + ": " + name_of(settings_.address) + ", unit " + std::to_string(settings_.unit) + ", " +
        std::string(info(entry.signal).name) + " at register " + std::to_string(entry.address) + " (function " +
        std::to_string(entry.function) + "): " + link.why() +
        (outcome == Outcome::refused
             ? ". See the meter's list of registers; addresses count from 0, without the 3 or 4 before them"
             : ". Is the meter on, and are unit and line settings its own?"));
  }
}

void Meter::run(std::unique_ptr<Link> link) noexcept {
  while (!quit_.wished()) {
    try {
      if (!link) link = std::make_unique<Link>(settings_.address, settings_.unit, settings_.timeout);
      poll(*link);
    } catch (const std::exception&) {  // it has gone, or is not back yet
      link.reset();
      handover_.raise(Fault::device_lost);
      quit_.rest(retry);
    }
  }
}

void Meter::poll(Link& link) {
  int failed = 0;
  while (!quit_.wished()) {
    const double next = machine_.now() + settings_.period;
    Fault fault = Fault::none;
    bool all = true;
    for (const Register& entry : settings_.registers) {
      const Outcome outcome = ask(link, entry, fault);
      all = all && outcome == Outcome::ok;
      if (outcome == Outcome::ok) {
        failed = 0;
        continue;
      }
      const bool over_tcp = std::holds_alternative<TcpAddress>(settings_.address);
      // A host that was switched off never says so: only a new connection tells.
      if (outcome == Outcome::gone || (over_tcp && ++failed >= attempts)) throw DeviceError(name_ + ": " + link.why());
      recover(link);
    }
    if (fault != Fault::none) {
      handover_.raise(fault);
    } else if (all) {
      handover_.clear();
    }
    quit_.rest(next - machine_.now());
  }
}

void Meter::recover(Link& link) const {
  if (std::holds_alternative<RtuAddress>(settings_.address)) quit_.rest(rest_timeouts * settings_.timeout);
  link.flush();
}

Outcome Meter::ask(Link& link, const Register& entry, Fault& fault) {
  std::array<std::uint16_t, 2> buffer{};
  const std::span words = std::span(buffer).first(static_cast<std::size_t>(words_of(entry.type)));
  const double asked = clock_->now();
  const Outcome outcome = link.read(entry.function, entry.address, words);
  const double answered = clock_->now();
  if (outcome == Outcome::refused) fault = Fault::wrong_function;
  if (outcome != Outcome::ok) return outcome;
  const double number = decode(words, entry.type, entry.order);
  if (!std::isfinite(number)) {
    fault = Fault::non_finite;
  } else if (entry.overload && number == *entry.overload) {
    fault = Fault::over_range;
  } else {
    handover_.deliver(entry.signal, (asked + answered) / 2 - settings_.latency,
                      entry.scaling.scale * number + entry.scaling.offset);
  }
  return outcome;
}

}  // namespace emtb::modbus_meter
