#include "tools/bench_inputs.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace emtb {
namespace {

constexpr double between_looks = 1e-3;  // [s]
constexpr double patience = 1;          // [s] beyond three periods, for a meter that has just been opened
constexpr double settle = 0.05;         // [s] of the first readings, which may come from before

/// Mean and scatter of readings as they come (Welford).
void take(ChannelSeen& seen, const Reading& reading, double& squares) {
  if (!std::isfinite(reading.value)) {
    seen.finite = false;
    ++seen.count;
    return;
  }
  if (seen.count == 0) seen.lowest = seen.highest = reading.value;
  ++seen.count;
  seen.lowest = std::min(seen.lowest, reading.value);
  seen.highest = std::max(seen.highest, reading.value);
  const double off = reading.value - seen.mean;
  seen.mean += off / static_cast<double>(seen.count);
  squares += off * (reading.value - seen.mean);
  seen.scatter = seen.count > 1 ? std::sqrt(squares / static_cast<double>(seen.count - 1)) : 0;
}

}  // namespace

ChannelSeen::Rail ChannelSeen::rail() const {
  const double edge = channel.lsb / 2;
  const auto resting = [this](double end) { return channel.conversion.scale != 0 && std::abs(raw(end)) < 1e-9; };
  if (count > 0 && highest >= channel.high - edge) return resting(channel.high) ? Rail::zero : Rail::upper;
  if (count > 0 && lowest <= channel.low + edge) return resting(channel.low) ? Rail::zero : Rail::lower;
  return Rail::none;
}

std::vector<ChannelSeen> look_at(BenchInputs& inputs, double seconds) {
  struct Place {
    std::size_t device;
    double squares = 0;
    double last = 0;  // [s]
  };
  std::vector<ChannelSeen> all;
  std::vector<Place> places;
  double longest = 0;
  for (std::size_t d = 0; d < inputs.devices.size(); ++d) {
    if (!inputs.devices[d].input) continue;
    for (const Channel& channel : inputs.devices[d].input->channels()) {
      all.push_back({.device = inputs.devices[d].name, .channel = channel});
      places.push_back({.device = d});
      longest = std::max(longest, 3 * channel.period + channel.window);
    }
    inputs.devices[d].input->start();
  }

  const double began = inputs.clock->now();
  const auto complete = [&] { return std::ranges::all_of(all, [](const ChannelSeen& s) { return s.count > 0; }); };
  std::array<Reading, 64> out{};
  for (double now = began; now < began + seconds || (!complete() && now < began + longest + patience + seconds);
       now = inputs.clock->now()) {
    for (std::size_t d = 0; d < inputs.devices.size(); ++d) {
      if (!inputs.devices[d].input) continue;
      const Readings got = inputs.devices[d].input->read(out);
      for (std::size_t k = 0; k < all.size(); ++k) {
        if (places[k].device != d) continue;
        all[k].fault = got.fault;
        for (std::size_t n = 0; n < got.count; ++n) {
          // A slow meter's window may have begun before anyone looked: its readings count all the same.
          if (out[n].signal != all[k].channel.signal) continue;
          if (all[k].channel.window == 0 && all[k].channel.period < settle && out[n].time < began) continue;
          take(all[k], out[n], places[k].squares);
          places[k].last = out[n].time;
        }
      }
    }
    inputs.clock->sleep_until(now + between_looks);
  }
  const double end = inputs.clock->now();
  for (std::size_t k = 0; k < all.size(); ++k) all[k].age = all[k].count > 0 ? end - places[k].last : end - began;
  return all;
}

}  // namespace emtb
