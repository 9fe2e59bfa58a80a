#include "drivers/replay/open.h"

#include <algorithm>
#include <cmath>

#include "drivers/replay/player.h"
#include "hal/error.h"
#include "session/spec.h"

namespace emtb::replay {
namespace {

/// A reference that drives nothing.
class Unconnected final : public AnalogOutput {
 public:
  explicit Unconnected(const Limits& limits) : limits_(limits) {}
  Fault set(double volts) noexcept override { return std::isfinite(volts) ? Fault::none : Fault::non_finite; }
  Fault make_safe() noexcept override { return Fault::none; }
  Limits limits() const noexcept override { return limits_; }

 private:
  Limits limits_;
};

Run only_run(std::string_view session) {
  auto runs = read_runs(session);
  if (runs.size() != 1) {
    throw SessionError(std::string(session) + ": holds " + std::to_string(runs.size()) +
                       " runs. Name one: " + runs.front().name);
  }
  return std::move(runs.front());
}

std::string name_of(std::string_view session) {
  const auto attributes = read_session(parse_session_spec(session).path).attributes;
  const auto profile = attributes.find("profile");
  return profile == attributes.end() || profile->second.empty() ? "replay" : profile->second;
}

/// The instants at which the loop set the reference; where it is not recorded, those of the fastest signal.
std::vector<double> ticks(const Run& run) {
  std::vector<double> t;
  if (run.has(Signal::u_ref)) {
    t = run.at(Signal::u_ref).t;
  } else {
    for (const auto& [signal, series] : run.signals) {
      if (series.t.size() > t.size()) t = series.t;
    }
  }
  if (t.front() > 0) t.insert(t.begin(), 0);
  return t;
}

std::vector<Knot> knots(const Run& run, double safe) {
  if (!run.has(Signal::u_ref)) return {{0, safe}};
  const Series& u = run.at(Signal::u_ref);
  std::vector<Knot> knots;
  for (std::size_t i = 0; i < u.t.size(); ++i) knots.push_back({u.t[i], u.value[i]});
  return knots;
}

}  // namespace

Replay open(std::string_view session, const Limits& reference, double period, double pace) {
  Run run = only_run(session);
  std::vector<double> t = ticks(run);
  std::vector<Knot> u = knots(run, reference.safe);
  // A run ends with the reference at its safe value. A recording that was cut off does not, and goes on for a tick; so
  // does one whose other signals end later.
  if (u.back().value != reference.safe) t.push_back(t.back() + period);
  if (run.duration() > t.back() + period) t.push_back(run.duration());
  if (u.back().t < t.back()) u.push_back({t.back(), u.back().value});

  const auto clock = std::make_shared<PlayClock>(std::move(t), period, pace);
  Bench bench{.clock = clock, .inputs = {}, .reference = std::make_unique<Unconnected>(reference)};
  for (auto& [signal, series] : run.signals) {
    if (signal == Signal::u_ref) continue;
    bench.inputs.push_back(std::make_unique<Player>(clock, signal, std::move(series)));
  }
  if (bench.inputs.empty()) throw SessionError(std::string(session) + ": holds the reference alone: nothing to replay");
  return {.bench = std::move(bench), .profile = Profile(name_of(session), std::move(u)), .play = [clock](bool on) {
            clock->play(on);
          }};
}

}  // namespace emtb::replay
