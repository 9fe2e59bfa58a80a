#include "drivers/serial_daq/board.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "hal/error.h"

namespace emtb::serial_daq {
namespace {

constexpr double reopen = 0.5;        // [s] between attempts to open a port that has gone
constexpr double ask_again = 0.3;     // [s] between questions to a board that is not up yet
constexpr double silence = 1;         // [s] without a sample: then it is asked anew; the loop has long noticed
constexpr double alive = 0.05;        // [s] between two duties at the latest: the board's watchdog waits 0.2 s
constexpr double breath = 0.004;      // [s] between two duties at the earliest: 7 bytes take 0.6 ms
constexpr double look_at_broken = 1;  // [s]
constexpr std::uint64_t many = 20;    // broken frames within that
constexpr double loop_away = 0.5;     // [s] that the loop may be away before readings are lost
constexpr double usual_top = 255;     // of a PWM with 8 bits, for the resolution that is shown

std::vector<Channel> describe(const std::string& name, const BoardSettings& settings, double analog_top) {
  std::vector<Channel> descriptions;
  const double period = 1 / settings.rate;
  for (const BoardChannel& channel : settings.channels) {
    Channel one{.signal = channel.signal, .period = period, .window = 0, .lsb = 0, .source = name};
    if (const auto* analog = std::get_if<Analog>(&channel.source)) {
      one.lsb = std::abs(analog->scale) / analog_top;
      one.source += " A" + std::to_string(analog->input);
      const double full = analog->offset + analog->scale;
      one.low = std::min(analog->offset, full);
      one.high = std::max(analog->offset, full);
      one.conversion = {.scale = analog->scale, .offset = analog->offset, .unit = "of full range", .from_file = true};
    } else if (const auto* encoder = std::get_if<Encoder>(&channel.source)) {
      const bool speed = channel.signal == Signal::omega;
      one.lsb = std::abs(encoder->per_count) / (speed ? period : 1);
      one.window = speed ? period : 0;
      one.source += " encoder";
      one.endless = true;
    } else {
      const auto* volts = std::get_if<double>(&settings.bus);
      one.lsb = (volts != nullptr ? *volts : std::abs(std::get<Analog>(settings.bus).scale)) / usual_top;
      one.source += " PWM times bus";
    }
    descriptions.push_back(one);
  }
  return descriptions;
}

}  // namespace

Board::Board(std::string name, std::shared_ptr<Clock> clock, BoardSettings settings)
    : name_(std::move(name)),
      clock_(std::move(clock)),
      settings_(std::move(settings)),
      period_(1 / settings_.rate),
      descriptions_(describe(name_, settings_, 1023)),
      handover_(descriptions_, static_cast<std::size_t>(std::max(
                                   256.0, loop_away * settings_.rate * static_cast<double>(descriptions_.size())))),
      scan_(period_),
      target_(settings_.limits, bell_) {
  try {
    connect();
  } catch (const DeviceError& e) {
    throw DeviceError(name_ + ": " + e.what());
  }
  descriptions_ = describe(name_, settings_, hello_->analog_top);
  thread_ = std::thread([this] { run(); });
}

Board::~Board() {
  make_safe();
  quit_ = true;
  bell_.ring();
  thread_.join();
}

void Board::start() {
  handover_.restart();
  start_ = true;
  bell_.ring();
}

Fault Board::set(double volts) noexcept {
  if (!target_.set(volts)) {
    make_safe();
    return Fault::non_finite;
  }
  return dropped_ ? Fault::output_failed : output_.load();
}

Fault Board::make_safe() noexcept {
  dropped_ = false;
  target_.make_safe();
  return output_;
}

void Board::connect() {
  hello_.reset();
  sampling_ = false;
  frames_ = {};
  port_ = std::make_unique<SerialPort>(settings_.port, settings_.line);
  const double until = machine_.now() + settings_.start_up;
  while (!hello_ && machine_.now() < until && !quit_) {
    port_->write(framed(ask_hello()));
    std::array<char, 256> buffer{};
    for (const double again = machine_.now() + ask_again; !hello_ && machine_.now() < again && !quit_;) {
      port_->wait(again - machine_.now(), bell_.descriptor());
      hear(port_->read(buffer));
      bell_.answer();
    }
  }
  if (!hello_) {
    throw DeviceError(settings_.port + ": no board says hello. Is the sketch of docs/serial-daq on it, and line: " +
                      std::to_string(settings_.line.baud) + " its own?");
  }
  if (hello_->version != protocol_version) {
    throw DeviceError(settings_.port + ": the board speaks version " + std::to_string(hello_->version) +
                      " of the protocol, emtb version " + std::to_string(protocol_version) +
                      ". Put the sketch of docs/serial-daq on it");
  }
  if (hello_->pwm_top == 0 || hello_->pwm_top > std::numeric_limits<std::int16_t>::max() || hello_->analog_top == 0) {
    throw DeviceError(settings_.port + ": the board says hello with a PWM or an analog range of nothing");
  }
  command(true);
}

void Board::run() noexcept {
  while (!quit_) {
    try {
      if (!port_) connect();
      talk();
    } catch (const std::exception&) {  // it has gone, or is not back yet
      port_.reset();
      output_ = Fault::output_failed;
      handover_.raise(Fault::device_lost);
      bell_.wait(reopen);
    }
  }
  try {
    if (port_) command(true);
  } catch (const std::exception&) {  // the board's watchdog does it
  }
}

void Board::talk() {
  std::array<char, 256> buffer{};
  while (!quit_) {
    if (start_ && !sampling_) ask_for_samples();
    port_->wait(command(false), bell_.descriptor());
    hear(port_->read(buffer));
    const double now = machine_.now();
    if (sampling_ && now - heard_ > silence) {
      throw DeviceError(settings_.port + ": is silent");  // opened anew, asked for its hello anew
    }
    if (now - scan_.looked > look_at_broken) {
      if (frames_.broken() - scan_.broken > many) handover_.raise(Fault::scan_broken);
      scan_.broken = frames_.broken();
      scan_.looked = now;
    }
  }
}

double Board::command(bool at_once) {
  bell_.answer();  // before the look at what is wanted: what changes after it rings anew
  const std::int16_t duty = duty_of(target_.volts());
  const double wait = told_ + (duty != told_duty_ ? breath : alive) - machine_.now();
  if (wait > 0 && !at_once) return wait;
  port_->write(framed(set_duty(duty)));
  told_duty_ = duty;
  told_ = machine_.now();
  return alive;
}

void Board::ask_for_samples() {
  port_->write(framed(ask_samples(static_cast<std::uint32_t>(std::lround(period_ * 1e6)))));
  scan_ = Scan(period_);
  scan_.broken = frames_.broken();
  scan_.looked = heard_ = machine_.now();
  sampling_ = true;
}

void Board::hear(std::string_view bytes) {
  frames_.feed(bytes, [this](std::span<const std::uint8_t> message) { take(message); });
  broken_ = frames_.broken();
}

void Board::take(std::span<const std::uint8_t> message) {
  if (auto hello = read_hello(message)) {
    hello_ = std::move(hello);
    if (!sampling_) return;
    sampling_ = false;  // it has started anew, and forgot everything
    handover_.raise(Fault::scan_broken);
  } else if (const auto sample = read_sample(message); sample && sampling_) {
    take(*sample);
  }
}

void Board::take(const Sample& sample) {
  const auto ahead = static_cast<std::uint16_t>(sample.number - static_cast<std::uint16_t>(scan_.next));
  if (scan_.next == 0 && ahead > settings_.rate) return;  // of the scan before, on its way when this one was asked for
  const std::uint64_t number = scan_.next + ahead;
  scan_.times.arrived(number, clock_->now() - settings_.line.wire_time(24));
  clock_report_.store(scan_.times.estimate());
  const double time = scan_.times.time_of(number);
  const std::int32_t step = scan_.before ? static_cast<std::int32_t>(sample.counts - scan_.before->counts) : 0;
  const double elapsed = scan_.before ? (sample.micros - scan_.before->micros) * 1e-6 : 0;  // [s]
  scan_.turned += step;
  const bool after_gap = elapsed <= 0 || ahead > 0;
  for (const BoardChannel& channel : settings_.channels) {
    const bool speed = std::holds_alternative<Encoder>(channel.source) && channel.signal == Signal::omega;
    if (speed && after_gap) continue;  // its mean would be over the gap as well
    handover_.deliver(channel.signal, time,
                      value(channel, sample, speed ? step / elapsed : static_cast<double>(scan_.turned)));
  }
  scan_.before = sample;
  scan_.next = number + 1;
  heard_ = machine_.now();
  if (sample.watchdog && told_duty_ != 0) dropped_ = true;
  output_ = Fault::none;
  handover_.clear();
}

double Board::value(const BoardChannel& channel, const Sample& sample, double counted) const noexcept {
  const auto measured = [&](const Analog& analog) {
    return analog.scale * sample.analog[analog.input] / hello_->analog_top + analog.offset;
  };
  if (const auto* analog = std::get_if<Analog>(&channel.source)) return measured(*analog);
  if (const auto* encoder = std::get_if<Encoder>(&channel.source)) {
    return encoder->per_count * counted;
  }
  const auto* volts = std::get_if<double>(&settings_.bus);
  const double bus = volts != nullptr ? *volts : measured(std::get<Analog>(settings_.bus));
  return bus * sample.duty / hello_->pwm_top;
}

std::int16_t Board::duty_of(double volts) const noexcept {
  const double duty = std::clamp(volts / settings_.full_duty, -1.0, 1.0);
  return static_cast<std::int16_t>(std::lround(duty * hello_->pwm_top));
}

}  // namespace emtb::serial_daq
