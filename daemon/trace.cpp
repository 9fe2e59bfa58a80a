#include "daemon/trace.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/traffic.h"
#include "server/rounded.h"
#include "server/rpc.h"

namespace emtb {

using nlohmann::json;

namespace {

constexpr double queue_seconds = 1, ring_seconds = 8;  // [s] that this thread, and a follower, may be away
constexpr double anew = 1;                             // [s] backwards: the clock began anew, as in a replay

/// Which bin a time is in; one that is its beginning but for rounding is in it.
std::int64_t bin_at(double t, double width) noexcept { return static_cast<std::int64_t>(std::floor(t / width + 1e-6)); }

/// Times to the microsecond.
double time_of(double t) { return std::round(t * 1e6) / 1e6; }

json empty_bins() {
  return {{"t", json::array()}, {"min", json::array()}, {"max", json::array()}, {"last", json::array()}};
}

void add(json& to, double t, double min, double max, double last) {
  to["t"].push_back(time_of(t));
  to["min"].push_back(rounded(min));
  to["max"].push_back(rounded(max));
  to["last"].push_back(rounded(last));
}

}  // namespace

void Trace::Bin::take(double value) noexcept {
  min = std::min(min, value);
  max = std::max(max, value);
  last = value;
}

void Trace::Bins::take(double t, double value) noexcept {
  const std::int64_t index = bin_at(t, width);
  if (count > 0) {
    Bin& newest = ring[(count - 1) % ring.size()];
    if (index <= newest.index) return newest.take(value);
  }
  ring[count++ % ring.size()] = {index, value, value, value};
}

Trace::Trace(const std::vector<Channel>& channels, double rate)
    : queue_(static_cast<std::size_t>(std::clamp(readings_per_second(channels, rate) * queue_seconds, 4096.0, 1e6))) {
  const auto samples = [](double per_second) {
    return static_cast<std::size_t>(std::clamp(ring_seconds * per_second, 1000.0, 1e5));
  };
  tracks_.emplace(Signal::u_ref, Track(samples(rate)));
  for (const Channel& channel : channels) {
    tracks_.emplace(channel.signal, Track(samples(readings_per_second(channel, rate))));
  }
}

void Trace::begin_anew() {
  for (auto& [signal, track] : tracks_) track.fine.count = track.coarse.count = 0;
  for (auto& [id, follower] : followers_) {
    for (auto& [signal, cursor] : follower.at) cursor.open = false;
  }
}

bool Trace::work() {
  constexpr std::size_t a_batch = 1000;
  const std::lock_guard lock(mutex_);
  Sample sample;
  for (std::size_t n = 0; n < a_batch; ++n) {
    if (!queue_.pop(sample)) return false;
    const auto found = tracks_.find(sample.signal);
    if (found == tracks_.end()) continue;
    if (sample.at < now_ - anew) begin_anew();
    now_ = sample.at < now_ - anew ? sample.at : std::max(now_, sample.at);
    Track& track = found->second;
    track.ring[track.count++ % track.ring.size()] = sample;
    track.fine.take(sample.at, sample.value);
    track.coarse.take(sample.at, sample.value);
  }
  return true;
}

void Trace::follow(std::uint64_t client, double bin) {
  const std::lock_guard lock(mutex_);
  Follower follower{.bin = bin, .dropped = 0, .lost = lost_.load(), .at = {}};
  for (const auto& [signal, track] : tracks_) follower.at[signal].next = track.count;
  followers_[client] = std::move(follower);
}

void Trace::forget(std::uint64_t client) {
  const std::lock_guard lock(mutex_);
  followers_.erase(client);
}

/// What the ring has overwritten meanwhile is dropped.
void Trace::catch_up(Follower& f, Cursor& cursor, const Track& track) const {
  const std::uint64_t oldest = track.count > track.ring.size() ? track.count - track.ring.size() : 0;
  if (cursor.next >= oldest) return;
  f.dropped += oldest - cursor.next;
  cursor.next = oldest;
}

json Trace::single(Follower& f, Signal signal, Track& track, std::size_t& room) const {
  json out{{"t", json::array()}, {"value", json::array()}};
  Cursor& cursor = f.at[signal];
  for (; cursor.next < track.count && room > 0; ++cursor.next, --room) {
    const Sample& s = track.ring[cursor.next % track.ring.size()];
    out["t"].push_back(time_of(s.at));
    out["value"].push_back(rounded(s.value));
  }
  return out;
}

json Trace::binned(Follower& f, Signal signal, Track& track, std::size_t& room) const {
  json out = empty_bins();
  Cursor& cursor = f.at[signal];
  const auto close = [&] {
    add(out, (static_cast<double>(cursor.bin.index) + 0.5) * f.bin, cursor.bin.min, cursor.bin.max, cursor.bin.last);
    cursor.open = false;
    --room;
  };
  for (; cursor.next < track.count && room > 0; ++cursor.next) {
    const Sample& s = track.ring[cursor.next % track.ring.size()];
    const std::int64_t index = bin_at(s.at, f.bin);
    if (cursor.open && index == cursor.bin.index) {
      cursor.bin.take(s.value);
      continue;
    }
    if (cursor.open) close();
    cursor.bin = {index, s.value, s.value, s.value};
    cursor.open = true;
  }
  // A slow meter's bin is over when time is, not when its next reading comes.
  if (cursor.open && room > 0 && now_ >= (static_cast<double>(cursor.bin.index) + 1) * f.bin) close();
  return out;
}

std::string Trace::block(std::uint64_t client) {
  const std::lock_guard lock(mutex_);
  const auto found = followers_.find(client);
  if (found == followers_.end()) return {};
  Follower& f = found->second;
  const std::uint64_t lost = lost_.load();
  f.dropped += lost - f.lost;
  f.lost = lost;
  json signals = json::object();
  for (auto& [signal, track] : tracks_) {
    std::size_t room = most_at_once / tracks_.size();
    catch_up(f, f.at[signal], track);
    json values = f.bin > 0 ? binned(f, signal, track, room) : single(f, signal, track, room);
    if (!values["t"].empty()) signals[std::string(info(signal).name)] = std::move(values);
  }
  if (signals.empty()) return {};
  return rpc::notification("samples",
                           {{"bin", f.bin}, {"dropped", std::exchange(f.dropped, 0)}, {"signals", std::move(signals)}});
}

json Trace::history(double last, std::size_t points) const {
  const std::lock_guard lock(mutex_);
  const bool fine = last <= fine_bin * static_cast<double>(fine_bins - 100);
  const double step = fine ? fine_bin : coarse_bin;
  points = std::max<std::size_t>(10, std::min(points, largest_history / (4 * tracks_.size())));
  const double wanted = last / static_cast<double>(points);
  const auto merged = static_cast<std::int64_t>(std::max(1.0, std::ceil(wanted / step - 1e-9)));
  const double width = static_cast<double>(merged) * step;
  const auto since = static_cast<std::int64_t>(std::floor((now_ - last) / step));
  json signals = json::object();
  for (const auto& [signal, track] : tracks_) {
    const Bins& bins = fine ? track.fine : track.coarse;
    const std::uint64_t held = std::min<std::uint64_t>(bins.count, bins.ring.size());
    json out = empty_bins();
    Bin open;
    bool any = false;
    const auto close = [&] {
      add(out, (static_cast<double>(open.index) + 0.5) * width, open.min, open.max, open.last);
    };
    for (std::uint64_t n = bins.count - held; n < bins.count; ++n) {
      const Bin& bin = bins.ring[n % bins.ring.size()];
      if (bin.index < since) continue;
      const std::int64_t index = bin.index >= 0 ? bin.index / merged : -((-bin.index + merged - 1) / merged);
      if (any && index == open.index) {
        open.min = std::min(open.min, bin.min);
        open.max = std::max(open.max, bin.max);
        open.last = bin.last;
        continue;
      }
      if (any) close();
      open = bin;
      open.index = index;
      any = true;
    }
    if (any) close();
    signals[std::string(info(signal).name)] = std::move(out);
  }
  return {{"bin", width}, {"dropped", 0}, {"signals", std::move(signals)}};
}

}  // namespace emtb
