#include "daemon/service.h"

#include <pwd.h>

#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <nlohmann/json.hpp>
#include <thread>

#include "config/profile.h"
#include "config/profile_path.h"
#include "daemon/version.h"

namespace emtb {
namespace {

using nlohmann::json;
using rpc::Refusal;

constexpr double default_rate = 20;                      // [Hz] of live lines
constexpr double highest_rate = 50;                      // [Hz]
constexpr auto reset_within = std::chrono::seconds(15);  // the slowest meter's patience

std::string_view word(State state) {
  constexpr std::array<std::string_view, 4> words{"latched", "arming", "armed", "running"};
  return words[static_cast<std::size_t>(state)];
}

std::string_view word(Outcome outcome) {
  constexpr std::array<std::string_view, 3> words{"done", "stopped", "fault"};
  return words[static_cast<std::size_t>(outcome)];
}

json fault_json(Fault fault, const std::string& what) {
  if (fault == Fault::none) return nullptr;
  const std::string_view words = text(fault);
  return {{"code", static_cast<int>(fault)}, {"name", words.substr(0, words.find(':'))}, {"text", what}};
}

std::string user_name(unsigned uid) {
  std::array<char, 4096> buffer{};
  passwd entry{};
  passwd* found = nullptr;
  getpwuid_r(uid, &entry, buffer.data(), buffer.size(), &found);
  return found != nullptr ? found->pw_name : std::to_string(uid);
}

json who(const rpc::Peer& peer) {
  return {{"pid", peer.pid}, {"uid", peer.uid}, {"gid", peer.gid}, {"user", user_name(peer.uid)}};
}

/// NaN has no JSON; null says `nothing`.
json finite(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

std::string utc_text(std::chrono::system_clock::time_point now) {
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count();
  const std::time_t seconds = ms / 1000;
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  std::array<char, 64> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &parts);
  std::array<char, 8> fraction{};
  std::snprintf(fraction.data(), fraction.size(), ".%03dZ", static_cast<int>(ms % 1000));
  return std::string(text.data()) + fraction.data();
}

bool is_inline(const std::string& profile) {
  return profile.find('\n') != std::string::npos || profile.find(": ") != std::string::npos;
}

std::string volts(double value) { return json(value).dump() + " V"; }

}  // namespace

Service::Service(const BenchConfig& bench, Settings settings, Mailbox& mailbox, Live& live, Recorder& recorder)
    : bench_(bench), settings_(std::move(settings)), mailbox_(mailbox), live_(live), recorder_(recorder) {
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
  plain("reset", [this](const Peer& peer) { return reset(peer); });
  plain("config", [this](const Peer&) { return config(); });
  plain("estimates", [](const Peer&) -> json { throw Refusal(rpc::code::not_available, "no live estimates yet"); });
  methods_.add("run", [this](const Params& params, const Peer& peer) { return run(params, peer); });
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
  json list = {{"u_ref", {{"value", finite(live_.u_ref.load())}, {"age", 0.0}, {"unit", "V"}}}};
  for (const Channel& channel : settings_.channels) {
    const auto& about = info(channel.signal);
    const double time = live_.time[index(channel.signal)].load();
    const bool seen = time != Live::never;
    list[std::string(about.name)] = {{"value", seen ? finite(live_.value[index(channel.signal)].load()) : nullptr},
                                     {"age", seen ? finite(std::max(0.0, now - time)) : nullptr},
                                     {"unit", about.unit}};
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
  const Lateness& late = live_.lateness;
  json answer = {{"version", version},
                 {"bench", bench_.name},
                 {"state", word(live_.state.load())},
                 {"fault", fault()},
                 {"reference_safe", !live_.output_broken.load()},
                 {"signals", signals()},
                 {"pace", settings_.pace},
                 {"loop",
                  {{"rate", bench_.rate},
                   {"ticks", live_.ticks.load()},
                   {"missed", live_.missed.load()},
                   {"late_us",
                    {{"p50", late.percentile(0.5) * 1e6},
                     {"p99", late.percentile(0.99) * 1e6},
                     {"p999", late.percentile(0.999) * 1e6},
                     {"max", late.max() * 1e6}}}}},
                 {"realtime", steps},
                 {"clients", clients},
                 {"run", nullptr},
                 {"last_run", nullptr}};
  const std::lock_guard lock(mutex_);
  if (current_) {
    answer["run"] = {{"id", current_->order->id},          {"profile", current_->order->profile.name()},
                     {"t", live_.run_time.load()},         {"duration", current_->order->profile.duration()},
                     {"session", current_->path.string()}, {"controller", who(current_->controller)}};
  }
  if (last_) answer["last_run"] = *last_;
  return answer;
}

std::string Service::live_line() const {
  json values = json::object();
  values["u_ref"] = finite(live_.u_ref.load());
  for (const Channel& channel : settings_.channels) {
    if (live_.time[index(channel.signal)].load() == Live::never) continue;
    values[std::string(info(channel.signal).name)] = finite(live_.value[index(channel.signal)].load());
  }
  json params = {{"state", word(live_.state.load())}, {"fault", fault()}, {"signals", values}, {"run", nullptr}};
  const std::lock_guard lock(mutex_);
  if (current_) {
    params["run"] = {{"id", current_->order->id},
                     {"profile", current_->order->profile.name()},
                     {"t", live_.run_time.load()},
                     {"duration", current_->order->profile.duration()}};
  }
  return rpc::notification("live", params);
}

Profile Service::find_profile(const std::string& text) const {
  try {
    if (is_inline(text)) return read_profile(YamlMap::parse(text, "profile"));
    return read_profile(profile_path(text, bench_.file));
  } catch (const Error& e) {
    throw Refusal(rpc::code::bad_profile, e.what());
  }
}

void Service::check(const Profile& profile) const {
  const Limits& limits = bench_.reference.limits;
  if (profile.max() > limits.max || profile.min() < limits.min) {
    throw Refusal(rpc::code::bad_profile, "profile " + profile.name() + " goes from " + volts(profile.min()) + " to " +
                                              volts(profile.max()) + ", but " + bench_.name + " allows " +
                                              volts(limits.min) + " to " + volts(limits.max) +
                                              ". Lower its level, or see reference in the bench file");
  }
  if (bench_.limits.time && profile.duration() > *bench_.limits.time) {
    throw Refusal(rpc::code::bad_profile, "profile " + profile.name() + " lasts " + json(profile.duration()).dump() +
                                              " s, but limits.time of " + bench_.name + " is " +
                                              json(*bench_.limits.time).dump() + " s");
  }
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

json Service::run(const rpc::Params& params, const rpc::Peer& peer) {
  params.only({"profile", "note", "operator"});
  refuse_if_busy("a run", peer);
  const auto now = std::chrono::system_clock::now();
  auto order = std::make_unique<const Order>(Order{next_run_, find_profile(params.text("profile"))});
  check(order->profile);
  if (live_.state.load() != State::armed) {
    const json cause = fault();
    const std::string why = cause.is_null() ? "not armed yet" : cause["text"].get<std::string>();
    throw Refusal(rpc::code::latched, "the bench is latched (" + why + "). See that it is safe, then `emtb reset`",
                  {{"fault", cause}});
  }

  SessionWriter::Description description{.channels = settings_.channels,
                                         .attributes = {{"profile", order->profile.name()},
                                                        {"bench", bench_.name},
                                                        {"operator", params.text_or("operator", user_name(peer.uid))},
                                                        {"note", params.text_or("note", "")},
                                                        {"software", std::string("emtbd ") + version},
                                                        {"started_utc", utc_text(now)}},
                                         .config = bench_.text};
  // A read-back is a step of the converter off and a tick late; what drives the model is the command.
  std::erase_if(description.channels, [](const Channel& c) { return c.signal == Signal::u_ref; });
  description.channels.push_back({.signal = Signal::u_ref, .period = 1 / bench_.rate, .source = "commanded reference"});
  const auto path = session_path(settings_.data, std::chrono::system_clock::to_time_t(now), order->profile.name());
  try {
    recorder_.open(path, description, order->profile.name());
  } catch (const SessionError& e) {
    throw Refusal(rpc::code::cannot_record, e.what());
  }

  const Order* wish = order.get();
  json answer = {{"run", wish->id},
                 {"profile", wish->profile.name()},
                 {"duration", wish->profile.duration()},
                 {"session", path.string()}};
  {
    const std::lock_guard lock(mutex_);
    current_ = Current{std::move(order), path, peer};
    ++next_run_;
  }
  mailbox_.run = wish;
  return answer;
}

json Service::stop() {
  const std::lock_guard lock(mutex_);
  if (!current_) return {{"stopped", nullptr}};
  mailbox_.stop = current_->order->id;  // anybody may stop: safety asks for no owner
  return {{"stopped", current_->order->id}};
}

json Service::reset(const rpc::Peer& peer) {
  refuse_if_busy("reset", peer);
  const std::uint64_t asked = ++mailbox_.resets;
  const auto until = std::chrono::steady_clock::now() + reset_within;
  while (live_.resets.load() < asked && std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  const State state = live_.state.load();
  if (state != State::armed) {
    const json cause = fault();
    throw Refusal(rpc::code::cause_stands,
                  "not armed: " + (cause.is_null() ? std::string(word(state)) : cause["text"].get<std::string>()),
                  {{"fault", cause}});
  }
  return {{"state", word(state)}};
}

json Service::subscribe(const rpc::Params& params, const rpc::Peer& peer) const {
  params.only({"rate"});
  const double rate = params.number_or("rate", default_rate, 0.1, highest_rate);
  if (socket_.subscribe) socket_.subscribe(peer.id, 1 / rate);
  return {{"rate", rate}};
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
  const Limits& limits = bench_.reference.limits;
  return {
      {"bench", bench_.name},
      {"file", bench_.file.string()},
      {"text", bench_.text},
      {"data", settings_.data.string()},
      {"rate", bench_.rate},
      {"reference", {{"min", limits.min}, {"max", limits.max}, {"safe", limits.safe}, {"rate", bench_.reference.rate}}},
      {"channels", channels}};
}

void Service::gone(const rpc::Peer& peer) {
  const std::lock_guard lock(mutex_);
  if (current_ && current_->controller.id == peer.id) mailbox_.lost = current_->order->id;
}

void Service::closed(const Closed& closed) {
  json how;
  {
    const std::lock_guard lock(mutex_);
    if (!current_) return;
    how = {{"run", current_->order->id},
           {"profile", current_->order->profile.name()},
           {"session", closed.path.string()},
           {"outcome", word(closed.outcome)},
           {"fault", fault_json(closed.fault, closed.text)},
           {"t", closed.t},
           {"complete", closed.complete}};
    last_ = std::make_unique<json>(how);
    current_.reset();
  }
  if (socket_.publish) socket_.publish(rpc::notification("ended", how));
}

bool Service::busy() const {
  const std::lock_guard lock(mutex_);
  return current_.has_value();
}

}  // namespace emtb
