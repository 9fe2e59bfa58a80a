#include "config/guards.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <sstream>

namespace emtb {
namespace {

std::string words(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

std::string with_unit(double value, Signal signal) { return words(value) + " " + std::string(info(signal).unit); }

struct Limit {
  Signal signal{};
  std::optional<double> value;
};

std::array<Limit, 3> limits_of(const BenchConfig& bench) {
  return {
      {{Signal::omega, bench.limits.omega}, {Signal::i_a, bench.limits.i_a}, {Signal::torque, bench.limits.torque}}};
}

std::string reach_of(const Channel& c) {
  if (c.endless) return "which counts without an end";
  return "which reads " + words(c.low) + " to " + with_unit(c.high, c.signal);
}

/// How long a value may be beyond the limit before a tick knows.
double delay_of(const Channel& channel, const BenchConfig& bench) {
  return std::max(channel.period, 1 / bench.rate) + channel.window + 1 / bench.rate;
}

/// Why this channel cannot tell that the limit is exceeded; empty: it can.
std::string blind(const Channel& c, double limit, const BenchConfig& bench) {
  if (c.endless) return "";
  const std::string key(info(c.signal).name);
  if (!std::isfinite(c.low) || !std::isfinite(c.high)) {
    return "guards nothing that is known: " + c.source +
           " does not say how far it reads. Write range: ... there, the largest " + std::string(info(c.signal).unit) +
           " that it can show";
  }
  const double down = bench.reference.limits.min < 0 ? -c.low : c.high;  // a driver of one direction turns no other way
  const double reach = std::min(c.high, down);
  if (reach > limit) return "";
  std::string line = reach > 0 ? "Write " + key + ": " + words(0.95 * reach) + " or less, or let it read further"
                               : "Let it read further, or remove the line";
  return "guards nothing: " + c.source + ", " + reach_of(c) + ", never reads beyond " + with_unit(limit, c.signal) +
         ". " + line;
}

double nearest_zero(const Limits& limits) { return std::clamp(0.0, limits.min, limits.max); }

}  // namespace

std::vector<Guard> guards_of(const BenchConfig& bench, std::span<const Channel> channels) {
  std::vector<Guard> guards;
  for (const auto& [signal, limit] : limits_of(bench)) {
    if (!limit) continue;
    Guard guard{.key = std::string(info(signal).name), .text = {}, .wrong = {}};
    const std::string what = "limits." + guard.key + ", " + with_unit(*limit, signal) + ": ";
    const auto channel = std::ranges::find(channels, signal, &Channel::signal);
    if (channel == channels.end()) {
      guard.wrong = "guards nothing: no device of this bench measures " + guard.key +
                    ". Is one of its devices not there? Else add a channel for it, or remove `" + guard.key + ": " +
                    words(*limit) + "`";
    } else {
      guard.wrong = blind(*channel, *limit, bench);
    }
    guard.text = what + (guard.wrong.empty() ? channel->source + ", " + reach_of(*channel) + ", says so within " +
                                                   words(std::ceil(1e4 * delay_of(*channel, bench)) / 1e4) + " s"
                                             : guard.wrong);
    guards.push_back(std::move(guard));
  }
  return guards;
}

void refuse_what_guards_nothing(const BenchConfig& bench, std::span<const Channel> channels) {
  const YamlMap yaml = YamlMap::parse(bench.text, bench.file.string());
  for (const Guard& guard : guards_of(bench, channels)) {
    if (!guard.wrong.empty()) yaml.map("limits").fail(guard.key, guard.wrong);
  }
  const Limits& limits = bench.reference.limits;
  if (limits.safe == nearest_zero(limits) || !bench.reference.safe_because.empty()) return;
  bench.reference.yaml.fail("safe", "is " + words(limits.safe) + " V, but of the allowed values " +
                                        words(nearest_zero(limits)) + " V is the nearest to 0. Write safe: " +
                                        words(nearest_zero(limits)) + ", or say why: safe_because: \"...\"");
}

std::string why_not_zero(const BenchConfig& bench) {
  const Limits& limits = bench.reference.limits;
  return limits.safe == nearest_zero(limits) ? std::string() : bench.reference.safe_because;
}

}  // namespace emtb
