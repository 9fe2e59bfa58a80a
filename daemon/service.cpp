#include "daemon/service.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <new>
#include <nlohmann/json.hpp>
#include <thread>

#include "config/guards.h"
#include "daemon/finite_or_null.h"
#include "daemon/sent_model.h"
#include "daemon/status_json.h"
#include "emtb/version.h"
#include "hal/format_version.h"

namespace emtb {
namespace {

using nlohmann::json;
using rpc::Refusal;

constexpr double default_rate = 20;                      // [Hz] of live lines
constexpr double highest_rate = 50;                      // [Hz]
constexpr double block_period = 0.05;                    // [s] between blocks of samples
constexpr auto reset_within = std::chrono::seconds(15);  // the slowest meter's patience

double utc_now() { return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count(); }

/// Where memory is refused, again and again: whoever waits for the end of a run would wait for ever.
template <class Work>
void try_for_a_second(Work work) {
  for (int tries = 10; tries > 0; --tries) {
    try {
      return work();
    } catch (const std::bad_alloc&) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  }
}

}  // namespace

Service::Service(const BenchConfig& bench, Settings settings, Mailbox& mailbox, Live& live, Recorder& recorder,
                 Estimator& estimator, Trace& trace)
    : bench_(bench),
      settings_(std::move(settings)),
      mailbox_(mailbox),
      live_(live),
      recorder_(recorder),
      estimator_(estimator),
      trace_(trace),
      admission_(bench, live,
                 {.data = settings_.data,
                  .channels = settings_.channels,
                  .room = settings_.room,
                  .recorded = settings_.recorded,
                  .replay_of = settings_.replay_of}) {
  using rpc::Params;
  using rpc::Peer;
  const auto plain = [this](const char* name, auto method) {  // those that take no parameters
    methods_.add(name, [method](const Params& params, const Peer& peer) {
      params.only({});
      return json(method(peer));
    });
  };
  plain("status", [this](const Peer& peer) { return status(peer); });
  plain("stop", [this](const Peer&) { return stop(); });
  plain("confirm", [this](const Peer& peer) { return confirm(peer); });
  methods_.add_slow("reset", [this](const Params& params, const Peer& peer) {
    params.only({});
    return reset(peer);
  });
  plain("config", [this](const Peer&) { return config(); });
  methods_.add("run", [this](const Params& params, const Peer& peer) { return run(params, peer); });
  methods_.add_slow("estimates", [this](const Params& params, const Peer&) { return estimates(params); });
  methods_.add("samples", [this](const Params& params, const Peer& peer) { return samples(params, peer); });
  methods_.add("history", [this](const Params& params, const Peer&) { return history(params); });
  methods_.add("subscribe", [this](const Params& params, const Peer& peer) { return subscribe(params, peer); });
}

Service::~Service() = default;

json Service::fault() const {
  const Fault fault = live_.fault.load();
  const int signal = live_.fault_signal.load();
  const auto named = signal >= 0 ? std::optional{static_cast<Signal>(signal)} : std::nullopt;
  return fault_json(fault, describe(fault, named, live_.fault_value.load()));
}

json Service::signals() const {
  const double now = live_.now.load();
  json list = {{"u_ref", {{"value", finite_or_null(live_.u_ref.load())}, {"age", 0.0}, {"unit", "V"}}}};
  for (const Channel& channel : settings_.channels) {
    const auto& about = info(channel.signal);
    const double time = live_.time[index(channel.signal)].load();
    const bool seen = time != Live::never;
    list[std::string(about.name)] = {
        {"value", seen ? finite_or_null(live_.value[index(channel.signal)].load()) : nullptr},
        {"age", seen ? finite_or_null(std::max(0.0, now - time)) : nullptr},
        {"unit", about.unit}};
  }
  return list;
}

json Service::clocks() const {
  json list = json::array();
  for (const DeviceClock& clock : settings_.clocks ? settings_.clocks() : std::vector<DeviceClock>()) {
    json names = json::array();
    for (const Signal signal : clock.signals) names.push_back(info(signal).name);
    list.push_back({{"signals", names},
                    {"fast_ppm", finite_or_null(clock.estimate.fast * 1e6)},
                    {"std_error_ppm", finite_or_null(clock.estimate.std_error * 1e6)},
                    {"ahead", finite_or_null(clock.estimate.ahead)},
                    {"over", finite_or_null(clock.estimate.over)}});
  }
  return list;
}

json Service::status(const rpc::Peer& peer) const {
  json clients = json::array();
  if (socket_.clients) {
    for (const rpc::Peer& client : socket_.clients()) {
      clients.push_back(who(client));
      clients.back()["you"] = client.id == peer.id;
    }
  }
  json steps = json::array();
  for (const RealtimeStep& step : realtime_) {
    steps.push_back({{"what", step.what}, {"ok", step.ok}, {"why", step.why}});
  }
  const Durations late = live_.lateness.durations();
  const Durations work = live_.work.durations();
  json answer = {{"protocol", newest_format::protocol},
                 {"version", version},
                 {"bench", bench_.name},
                 {"state", word(live_.state.load())},
                 {"fault", fault()},
                 {"reference_safe", !live_.output_broken.load()},
                 {"signals", signals()},
                 {"clocks", clocks()},
                 {"pace", settings_.pace},
                 {"loop",
                  {{"rate", bench_.rate},
                   {"ticks", live_.ticks.load()},
                   {"missed", live_.missed.load()},
                   {"late_us", percentiles(late)},
                   {"work_us", percentiles(work)},
                   {"late_histogram", histogram(late)},
                   {"work_histogram", histogram(work)}}},
                 {"realtime", steps},
                 {"clients", clients},
                 {"run", nullptr},
                 {"last_run", nullptr},
                 {"black_box", nullptr}};
  const std::lock_guard lock(mutex_);
  if (current_) {
    json controller = who(current_->controller);
    controller["you"] = current_->controller.id == peer.id;
    answer["run"] = {{"id", current_->order->id},
                     {"profile", current_->order->profile.name()},
                     {"t", live_.run_time.load()},
                     {"done", live_.profile_time.load()},
                     {"duration", current_->order->profile.duration()},
                     {"session", current_->path.string()},
                     {"controller", controller},
                     {"pause", pause()}};
  }
  if (last_) answer["last_run"] = *last_;
  if (!black_box_.empty()) answer["black_box"] = black_box_.string();
  return answer;
}

std::string Service::live_line(std::uint64_t peer) const {
  json values = json::object();
  values["u_ref"] = finite_or_null(live_.u_ref.load());
  for (const Channel& channel : settings_.channels) {
    if (live_.time[index(channel.signal)].load() == Live::never) continue;
    values[std::string(info(channel.signal).name)] = finite_or_null(live_.value[index(channel.signal)].load());
  }
  json params = {{"state", word(live_.state.load())}, {"fault", fault()}, {"signals", values}, {"run", nullptr}};
  const std::lock_guard lock(mutex_);
  if (current_) {
    params["run"] = {{"id", current_->order->id},
                     {"profile", current_->order->profile.name()},
                     {"t", live_.run_time.load()},
                     {"done", live_.profile_time.load()},
                     {"duration", current_->order->profile.duration()},
                     {"pause", pause()}};
  }
  if (want_estimates_.contains(peer)) {
    try {
      params["estimates"] = estimator_.estimates();
    } catch (const Error&) {
      params["estimates"] = nullptr;  // the method of that name says why
    }
  }
  return rpc::notification("live", params);
}

json Service::pause() const {
  const int waiting = live_.pause.load();
  if (!current_ || waiting < 0 || static_cast<std::size_t>(waiting) >= current_->order->pauses.size()) return nullptr;
  const Pause& pause = current_->order->pauses[static_cast<std::size_t>(waiting)];
  return {{"number", waiting + 1}, {"say", pause.say}, {"within", pause.within}};
}

void Service::refuse_if_busy(const std::string& what, const rpc::Peer& peer) const {
  const std::lock_guard lock(mutex_);
  if (!current_) return;
  const rpc::Peer& controller = current_->controller;
  const std::string whose = controller.id == peer.id
                                ? "yours"
                                : "of " + user_name(controller.uid) + ", process " + std::to_string(controller.pid);
  throw Refusal(rpc::code::busy,
                what + " has to wait: run " + current_->order->profile.name() + " (" + whose + ") is on",
                {{"who", who(controller)}, {"run", current_->order->id}});
}

/// What a session says of itself.
SessionWriter::Description Service::session_of(const Order& order, const rpc::Params& params, const rpc::Peer& peer,
                                               double now) const {
  SessionWriter::Description description{.channels = recorded_channels(settings_.channels, bench_.rate),
                                         .attributes = {{"profile", order.profile.name()},
                                                        {"bench", bench_.name},
                                                        {"operator", params.text_or("operator", user_name(peer.uid))},
                                                        {"note", params.text_or("note", "")},
                                                        {"software", std::string("emtbd ") + version},
                                                        {"started_utc", utc_text(now)}},
                                         .config = bench_.text};
  if (const std::string brake = params.text_or("brake", ""); !brake.empty()) description.attributes["brake"] = brake;
  if (!settings_.replay_of.empty()) description.attributes["replay_of"] = settings_.replay_of;
  return description;
}

json Service::run(const rpc::Params& params, const rpc::Peer& peer) {
  params.only({"profile", "note", "operator", "brake"});
  const std::uint64_t stops = mailbox_.stops.load();  // one that comes while we prepare is of this run, too
  refuse_if_busy("a run", peer);
  const double now = utc_now();
  Experiment experiment = admission_.find(params.text("profile"));
  if (live_.state.load() != LoopState::armed) {
    const json cause = fault();
    const std::string why = cause.is_null() ? "not armed yet" : cause["text"].get<std::string>();
    throw Refusal(rpc::code::latched, "the bench is latched (" + why + "). See that it is safe, then `emtb reset`",
                  {{"fault", cause}});
  }

  admission_.refuse_unless_ready(experiment);
  auto order = std::make_unique<const Order>(
      Order{next_run_, std::move(experiment.profile), std::move(experiment.pauses), stops});

  const SessionWriter::Description description = session_of(*order, params, peer, now);
  const auto path = session_path(settings_.data, static_cast<std::int64_t>(now), order->profile.name());
  const Order* const wish = order.get();
  json answer = {{"run", wish->id},
                 {"profile", wish->profile.name()},
                 {"duration", wish->profile.duration()},
                 {"session", path.string()}};
  Current current{.order = std::move(order),
                  .path = path,
                  .controller = peer,
                  .late = live_.lateness.durations(),
                  .work = live_.work.durations(),
                  .missed = live_.missed.load()};
  try {
    recorder_.open(path, description, wish->profile.name());
  } catch (const SessionError& e) {
    throw Refusal(rpc::code::cannot_record, e.what());
  }
  {  // nothing here may fail any more: the recorder waits for this run's end
    const std::lock_guard lock(mutex_);
    current_ = std::move(current);
    ++next_run_;
  }
  mailbox_.run = wish;
  return answer;
}

std::string Service::figures() const {
  const std::lock_guard lock(mutex_);
  if (!current_) return {};
  const Durations late = live_.lateness.durations().since(current_->late);
  if (late.total() == 0 || settings_.pace != "1") return {};
  return percentiles_text("woke late by", late) + "; " +
         percentiles_text("worked", live_.work.durations().since(current_->work)) + "; " +
         std::to_string(live_.missed.load() - current_->missed) + " deadlines missed";
}

void Service::dumped(const std::filesystem::path& path) {
  const std::lock_guard lock(mutex_);
  black_box_ = path;
}

json Service::stop() {
  const std::lock_guard lock(mutex_);
  ++mailbox_.stops;  // anybody may stop: safety asks for no owner
  if (!current_) return {{"stopped", nullptr}};
  return {{"stopped", current_->order->id}};
}

json Service::confirm(const rpc::Peer& peer) {
  const std::lock_guard lock(mutex_);
  const int waiting = live_.pause.load();
  if (!current_ || waiting < 0) throw Refusal(rpc::code::not_available, "no run waits for anybody");
  const rpc::Peer& controller = current_->controller;
  if (peer.id != controller.id && peer.uid != controller.uid) {
    throw Refusal(rpc::code::busy, "the run is of " + user_name(controller.uid) + ", who confirms",
                  {{"who", who(controller)}, {"run", current_->order->id}});
  }
  mailbox_.confirmed = confirmation(current_->order->id, static_cast<std::size_t>(waiting));
  return {{"confirmed", waiting + 1}};
}

rpc::Later Service::reset(const rpc::Peer& peer) {
  refuse_if_busy("reset", peer);
  const std::uint64_t asked = mailbox_.reset();
  const auto until = std::chrono::steady_clock::now() + reset_within;
  return [this, asked, until]() -> json {
    if (live_.resets.load() < asked && std::chrono::steady_clock::now() < until) return nullptr;
    const LoopState state = live_.state.load();
    if (state == LoopState::armed) return {{"state", word(state)}};
    const json cause = fault();
    const std::string why = !cause.is_null() ? cause["text"].get<std::string>()
                            : state == LoopState::latched
                                ? "a stop came meanwhile. See that it is safe, then reset again"
                                : std::string(word(state));
    throw Refusal(rpc::code::cause_stands, "not armed: " + why, {{"fault", cause}});
  };
}

json Service::subscribe(const rpc::Params& params, const rpc::Peer& peer) {
  params.only({"rate", "estimates"});
  const double rate = params.number_or("rate", default_rate, 0.1, highest_rate);
  if (params.flag_or("estimates", false)) {
    const std::lock_guard lock(mutex_);
    want_estimates_.insert(peer.id);
  }
  if (socket_.subscribe) socket_.subscribe(peer.id, 1 / rate);
  return {{"rate", rate}};
}

json Service::samples(const rpc::Params& params, const rpc::Peer& peer) {
  params.only({"bin"});
  const double bin = params.number_or("bin", 0.02, 0, 60);
  if (bin > 0 && bin < 1e-4) throw Refusal(rpc::code::invalid_params, "`bin` is 0, or 0.0001 to 60 s");
  trace_.follow(peer.id, bin);
  if (socket_.stream) socket_.stream(peer.id, block_period);
  return {{"bin", bin}};
}

json Service::history(const rpc::Params& params) const {
  params.only({"last", "points"});
  const double last = params.number_or("last", 600, 0.1, 3600), points = params.number_or("points", 700, 10, 2000);
  return trace_.history(last, static_cast<std::size_t>(points));
}

/// @param params `model`: the text of a model file to follow from now on; it moves nothing, so that anybody may
rpc::Later Service::estimates(const rpc::Params& params) {
  params.only({"model"});
  const auto or_refusal = [](const auto& ask) {
    try {
      return ask();
    } catch (const Error& e) {
      throw Refusal(rpc::code::not_available, e.what());
    }
  };
  const std::string text = params.text_or("model", "");
  if (text.empty()) return [this, or_refusal] { return or_refusal([this] { return estimator_.estimates(); }); };
  const auto there = or_refusal([&] { return estimator_.propose(read_sent_model(text)); });
  return [or_refusal, there] { return or_refusal(there); };
}

json Service::config() const {
  json channels = json::array();
  for (const Channel& channel : settings_.channels) {
    channels.push_back({{"signal", info(channel.signal).name},
                        {"unit", info(channel.signal).unit},
                        {"period", channel.period},
                        {"window", channel.window},
                        {"lsb", channel.lsb},
                        {"source", channel.source}});
  }
  json guards = json::array();
  for (const Guard& guard : guards_of(bench_, settings_.channels)) {
    guards.push_back({{"key", guard.key}, {"text", guard.text}, {"wrong", guard.wrong}});
  }
  const Limits& limits = bench_.reference.limits;
  return {
      {"bench", bench_.name},
      {"file", bench_.file.string()},
      {"text", bench_.text},
      {"data", settings_.data.string()},
      {"rate", bench_.rate},
      {"reference", {{"min", limits.min}, {"max", limits.max}, {"safe", limits.safe}, {"rate", bench_.reference.rate}}},
      {"channels", channels},
      {"guards", guards}};
}

void Service::gone(const rpc::Peer& peer) {
  trace_.forget(peer.id);
  const std::lock_guard lock(mutex_);
  want_estimates_.erase(peer.id);
  if (current_ && current_->controller.id == peer.id) mailbox_.lost = current_->order->id;
}

std::unique_ptr<json> Service::ended(const Closed& closed) const {
  const std::lock_guard lock(mutex_);
  return std::make_unique<json>(json{{"run", current_->order->id},
                                     {"profile", current_->order->profile.name()},
                                     {"session", closed.path.string()},
                                     {"outcome", word(closed.outcome)},
                                     {"fault", fault_json(closed.fault, closed.text)},
                                     {"t", closed.t},
                                     {"complete", closed.complete}});
}

void Service::closed(const Closed& closed) {
  if (!busy()) return;
  std::unique_ptr<json> how;
  std::string line;
  try_for_a_second([&] {
    how = ended(closed);
    line = rpc::notification("ended", *how);
  });
  {
    const std::lock_guard lock(mutex_);
    last_ = std::move(how);
    current_.reset();
    admission_.run_ended();
  }
  if (!line.empty() && socket_.publish) try_for_a_second([&] { socket_.publish(line); });
}

bool Service::busy() const {
  const std::lock_guard lock(mutex_);
  return current_.has_value();
}

}  // namespace emtb
