#include "drivers/serial_meter/meter.h"

#include <algorithm>

#include "hal/error.h"

namespace emtb::serial_meter {
namespace {

constexpr double retry = 0.5;       // [s] between attempts to open a port that has gone
constexpr double patience = 1;      // [s] of one wait for a meter that talks by itself
constexpr double quiet = 0.3;       // [s] without a byte: no answer, to a device clear for one, is on its way
constexpr double longest_talk = 2;  // [s] of a meter that does not fall silent

}  // namespace

Meter::Meter(const std::string& name, std::shared_ptr<Clock> clock, const MeterSettings& settings)
    : clock_(std::move(clock)),
      settings_(settings),
      protocol_(*settings.model->protocol),
      description_{
          .signal = settings.signal,
          .period = settings.period,
          .window = settings.window,
          .lsb = settings.digit,
          .source = name + " (" + std::string(settings.model->maker) + ", " + std::string(settings.function.name) + ")",
          .conversion = {.scale = settings.scale,
                         .offset = settings.offset,
                         .unit = settings.function.unit,
                         .from_file = true,
                         .file_unit = settings.file_unit,
                         .file_zero = settings.file_zero}},
      handover_(std::span(&description_, 1)) {
  if (settings_.reach > 0) {
    description_.low = settings_.offset - settings_.reach;
    description_.high = settings_.offset + settings_.reach;
  }
  auto port = std::make_unique<SerialPort>(settings_.port, settings_.line);
  thread_ = std::thread([this, open = std::move(port)]() mutable { run(std::move(open)); });
}

Meter::~Meter() {
  quit_.wish();
  thread_.join();
}

void Meter::run(std::unique_ptr<SerialPort> port) noexcept {
  while (!quit_.wished()) {
    try {
      if (!port) port = std::make_unique<SerialPort>(settings_.port, settings_.line);
      Conversation talk(*port, protocol_.find, quit_.descriptor());
      if (protocol_.requests.empty()) {
        listen(talk);
      } else {
        poll(talk);
      }
    } catch (const std::exception&) {  // the port has gone, or is not back yet
      port.reset();
      handover_.raise(Fault::device_lost);
      quit_.rest(retry);
    }
  }
}

void Meter::listen(Conversation& talk) {
  while (!quit_.wished()) {
    const Message message = talk.listen(machine_.now() + patience);
    if (message.kind == Message::Kind::reading) judge(message.measurement, end_of_window(message));
  }
}

void Meter::poll(Conversation& talk) {
  bool in_step = false;
  while (!quit_.wished()) {
    const double next = machine_.now() + settings_.period;
    if (!in_step) in_step = set_up(talk);
    if (!in_step) {
      quit_.rest(next - machine_.now());
      continue;
    }
    if (const auto answer = ask(talk)) {
      judge(answer->measurement, answer->time);
      quit_.rest(next - machine_.now());
    } else {
      in_step = false;
    }
  }
}

bool Meter::prompted(Conversation& talk) {
  const double until = machine_.now() + settings_.timeout;
  while (true) {
    const Message message = talk.listen(until);
    if (message.kind == Message::Kind::partial) return false;
    // A refusal will do: what counts is what the readings turn out to be of.
    if (message.kind == Message::Kind::prompt || message.kind == Message::Kind::refusal) return true;
  }
}

bool Meter::set_up(Conversation& talk) {
  if (!protocol_.clear.empty()) talk.say(protocol_.clear);
  talk.settle(quiet, longest_talk);
  if (protocol_.set_up == nullptr) return true;
  for (const std::string& line : protocol_.set_up(settings_.function, settings_.range, settings_.model->line_cycles)) {
    talk.say(line);
    if (protocol_.prompts && !prompted(talk)) return false;
  }
  if (protocol_.barrier.empty()) return true;
  talk.say(protocol_.barrier);
  return prompted(talk);
}

std::optional<Meter::Answer> Meter::ask(Conversation& talk) {
  std::optional<Answer> answer;
  for (const std::string_view request : protocol_.requests) {
    talk.say(request);
    const double until = machine_.now() + settings_.timeout;
    bool answered = false;
    bool done = !protocol_.prompts;
    while (!answered || !done) {
      const Message message = talk.listen(until);
      switch (message.kind) {
        case Message::Kind::reading:
          if (answer) return std::nullopt;  // one too many: an earlier request is answered late
          answer = Answer{.measurement = message.measurement, .time = end_of_window(message)};
          answered = true;
          break;
        case Message::Kind::function:
          if (!answer || answered) return std::nullopt;
          answer->measurement.quantity = message.measurement.quantity;
          answer->measurement.coupling = message.measurement.coupling;
          answered = true;
          break;
        case Message::Kind::prompt:
          if (!protocol_.prompts) break;  // a barrier that was answered late
          if (!answered) return std::nullopt;
          done = true;
          break;
        default:
          return std::nullopt;
      }
    }
  }
  return answer;
}

double Meter::end_of_window(const Message& message) const noexcept {
  return clock_->now() - settings_.line.wire_time(message.length) - settings_.latency;
}

void Meter::judge(const Measurement& measurement, double time) noexcept {
  if (!settings_.function.is_of(measurement)) {
    handover_.raise(Fault::wrong_function);
  } else if (measurement.overload) {
    handover_.raise(Fault::over_range);
  } else {
    handover_.clear();
    handover_.deliver(settings_.signal, time, settings_.scale * measurement.value + settings_.offset);
  }
}

}  // namespace emtb::serial_meter
