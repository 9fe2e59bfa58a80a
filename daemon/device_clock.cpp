#include "daemon/device_clock.h"

#include <array>
#include <cmath>
#include <cstdio>

namespace emtb {

std::vector<DeviceClock> device_clocks(const Bench& bench) {
  std::vector<DeviceClock> clocks;
  for (const auto& device : bench.inputs) {
    const auto estimate = device->own_clock();
    if (!estimate) continue;
    DeviceClock clock{.signals = {}, .estimate = *estimate};
    for (const Channel& channel : device->channels()) clock.signals.push_back(channel.signal);
    clocks.push_back(std::move(clock));
  }
  return clocks;
}

std::string describe(const DeviceClock& clock) {
  std::string words;
  for (const Signal signal : clock.signals) words += (words.empty() ? "" : ", ") + std::string(info(signal).name);
  const ClockEstimate& estimate = clock.estimate;
  if (!std::isfinite(estimate.std_error)) return words + ": how their clock runs against ours is not known yet";
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), ": their clock is %s by %.1f ppm (+-%.1f, over %.0f s), %.3g ms by now",
                estimate.fast < 0 ? "slow" : "fast", std::abs(estimate.fast) * 1e6, estimate.std_error * 1e6,
                estimate.over, std::abs(estimate.ahead) * 1e3);
  return words + text.data();
}

}  // namespace emtb
