#include "daemon/daemon.h"

#include <algorithm>
#include <chrono>
#include <new>
#include <utility>

#include "config/guards.h"
#include "config/model.h"
#include "daemon/traffic.h"
#include "emtb/version.h"
#include "hal/error.h"

namespace emtb {
namespace {

constexpr double ring_seconds = 4;  // [s] that the recorder may be away: worst flush 0.1 s, a disk that spins up 3 s

double wall() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

std::vector<Channel> channels(const Bench& bench) {
  std::vector<Channel> all;
  for (const auto& device : bench.inputs) {
    all.insert(all.end(), device->channels().begin(), device->channels().end());
  }
  return all;
}

std::size_t ring_size(const BenchConfig& config, const Bench& bench) {
  const double per_second = readings_per_second(channels(bench), config.rate);
  return static_cast<std::size_t>(std::clamp(per_second * ring_seconds, 4096.0, 4e6));
}

std::string in_words(const Closed& closed) {
  switch (closed.outcome) {
    case Outcome::done:
      return "done";
    case Outcome::stopped:
      return "stopped";
    case Outcome::fault:
      break;
  }
  return closed.text;
}

}  // namespace

Daemon::Daemon(const BenchConfig& config, Bench bench, UnixSocketServer& server, Settings settings)
    : config_(config),
      bench_{std::move(bench)},
      server_(server),
      channels_(channels(bench_)),
      settings_([&] {
        if (!settings.room) settings.room = [data = settings.data] { return free_space(data); };
        return std::move(settings);
      }()),
      ring_(ring_size(config_, bench_)),
      trace_(channels_, config_.rate),
      estimator_({.channels = channels_,
                  .loop_rate = config_.rate,
                  .rate = config_.estimates ? config_.estimates->rate : BenchConfig::Estimates{}.rate}),
      recorder_(ring_, mailbox_.recorder_failed, settings_.open_sink, listeners_of_recorder(),
                surroundings_of_recorder()),
      service_(config_, service_settings(), mailbox_, live_, recorder_, estimator_, trace_),
      loop_(bench_, loop_settings(), mailbox_, live_, ring_, &estimator_.feed(), &trace_) {
  if (settings_.replay_of.empty()) {
    refuse_what_guards_nothing(config_, channels_);
    for (const Guard& guard : guards_of(config_, channels_)) settings_.log(guard.text);
    const std::string why = why_not_zero(config_);
    if (!why.empty())
      settings_.log("reference.safe is " + std::to_string(config_.reference.limits.safe) + " V" + ", because: " + why);
  }
  follow_named_model();
  service_.connect({.subscribe = [this](std::uint64_t peer, double period) { server_.subscribe(peer, period); },
                    .stream = [this](std::uint64_t peer, double period) { server_.stream(peer, period); },
                    .clients = [this] { return server_.clients(); },
                    .publish = [this](std::string line) { server_.publish(std::move(line)); }});
  try {
    begin();
  } catch (...) {  // no thread, no memory: what has begun ends, the reference is safe
    end();
    throw;
  }
}

void Daemon::begin() {
  loop_thread_ = std::make_unique<LoopThread>(
      loop_, *bench_.clock, live_,
      LoopThread::Settings{.period = 1 / config_.rate, .realtime = settings_.realtime, .pace = settings_.set_pace});
  for (const RealtimeStep& step : loop_thread_->realtime()) {
    settings_.log("real time: " + step.what + (step.ok ? ": yes" : ": no: " + step.why));
  }
  service_.set_realtime(loop_thread_->realtime());
  recorder_thread_ = std::thread([this] { record(); });
  trace_thread_ = std::thread([this] { keep_trace(); });
  if (settings_.at_work) settings_.at_work();
  server_.start({.line = [this](std::string_view line, const rpc::Peer& peer) { return service_.answer(line, peer); },
                 .gone = [this](const rpc::Peer& peer) { service_.gone(peer); },
                 .live = [this](std::uint64_t peer) { return service_.live_line(peer); },
                 .block = [this](std::uint64_t peer) { return trace_.block(peer); },
                 .stop = {.stop = [this] { return ++mailbox_.stops; },
                          .stopped = [this](std::uint64_t number) { return stopped(number); }}});
}

Recorder::Listeners Daemon::listeners_of_recorder() {
  return {.closed =
              [this](const Closed& closed) {
                try {
                  settings_.log(closed.path.string() + ": " + in_words(closed));
                } catch (const std::bad_alloc&) {  // the run has ended all the same
                }
                service_.closed(closed);
              },
          .happened = [this](const std::string& text) { settings_.log(text); },
          .figures = [this] { return service_.figures(); },
          .clocks =
              [this] {
                std::vector<std::string> texts;
                for (const DeviceClock& clock : device_clocks(bench_)) texts.push_back(describe(clock));
                return texts;
              },
          .dumped = [this](const std::filesystem::path& path) { service_.dumped(path); },
          .remarks = [this](std::uint32_t run) { return estimator_.remarks(run); }};
}

Recorder::Surroundings Daemon::surroundings_of_recorder() {
  return {.disk_low = &mailbox_.disk_low,
          .room = settings_.room,
          .black_box = BlackBox({.folder = settings_.data,
                                 .channels = recorded_channels(channels_, config_.rate),
                                 .period = 1 / config_.rate,
                                 .attributes = {{"bench", config_.name}, {"software", std::string("emtbd ") + version}},
                                 .config = config_.text})};
}

Service::Settings Daemon::service_settings() const {
  return {.data = settings_.data,
          .channels = channels_,
          .pace = settings_.pace,
          .room = settings_.room,
          .clocks = [this] { return device_clocks(bench_); },
          .recorded = settings_.recorded,
          .replay_of = settings_.replay_of};
}

Loop::Settings Daemon::loop_settings() const {
  return {.limits = config_.limits,
          .reference = config_.reference.limits,
          .rate = config_.reference.rate,
          .field_min = config_.field_min,
          .tacho = config_.tacho,
          .R_a = config_.motor.R_a.value_or(0),
          .period = 1 / config_.rate,
          .real_time = !settings_.set_pace};
}

/// On the stop's own thread.
std::optional<Stopped> Daemon::stopped(std::uint64_t number) const noexcept {
  if (live_.stops.load(std::memory_order_acquire) < number) return std::nullopt;
  return Stopped{.run = live_.stopped_run.load(), .safe = !live_.output_broken.load()};
}

/// The recorder's thread.
void Daemon::record() {
  constexpr std::size_t a_batch = 1000;                        // records: after so many, more are likely waiting
  constexpr std::chrono::milliseconds recording{5}, idle{50};  // rests, short against the ring's seconds
  while (!quit_) {
    try {
      if (recorder_.work(wall()) > a_batch) continue;
    } catch (const std::bad_alloc&) {       // the bench is made safe, the fault named; what was flushed is kept
      recorder_.give_up("no memory left");  // short enough to need none
    }
    std::this_thread::sleep_for(recorder_.recording() ? recording : idle);
  }
}

/// The trace's thread.
void Daemon::keep_trace() {
  while (!quit_) {
    // In simulated time there is always more: those who ask get their turn in between.
    std::this_thread::sleep_for(trace_.work() ? std::chrono::microseconds(200) : std::chrono::microseconds(10'000));
  }
}

Daemon::~Daemon() {
  terminate();
  end();
}

void Daemon::end() {
  server_.stop();
  loop_thread_.reset();
  bench_.reference->make_safe();
  quit_ = true;
  for (std::thread* thread : {&recorder_thread_, &trace_thread_}) {
    if (thread->joinable()) thread->join();
  }
  recorder_.finish();
}

/// The model that the bench file names. Without it the bench still works: the log says why, and who asks for estimates.
void Daemon::follow_named_model() {
  if (!config_.estimates) return;
  try {
    estimator_.follow(read_model(config_.estimates->model));
  } catch (const Error& e) {
    settings_.log(std::string("no live estimates: ") + e.what());
    estimator_.explain(e.what());
  }
}

void Daemon::guardian_lost(bool replaced) noexcept {
  mailbox_.unguarded = !replaced;
  ++mailbox_.guardians_lost;
}

void Daemon::terminate() {
  mailbox_.terminate = true;
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(10);  // a slow disk's last flush
  while (service_.busy() && std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

}  // namespace emtb
