#include "analysis/live/plan.h"

#include <algorithm>
#include <string>

#include "hal/error.h"
#include "model/catalogue.h"

namespace emtb {
namespace {

bool is_fast(const Channel& channel, double period) { return channel.window <= 0 && channel.period < 2 * period; }

void refuse_unless_driven(const Model& model, bool input_is_fast) {
  if (model.input == Signal::u_ref || input_is_fast) return;
  throw ModelError("model `" + model.name + "` is driven by " + std::string(info(model.input).name) +
                   ", which this bench does not measure at every tick. Give it `input: u_ref`");
}

/// Lengths in time, by the time constant of the shaft. The shares are by hand (docs/decisions/live-estimates.md).
void set_lengths(LivePlan& plan, double time_constant, double rate, double chapter) {
  plan.longest_step = std::clamp(time_constant / 50, 2e-4, 1e-2);
  // Short against the shaft's time constant, so that a block's mean says what its readings do.
  plan.block = static_cast<std::size_t>(std::max(2.0, std::clamp(time_constant / 2, 0.0, 0.1) / plan.period));
  plan.second = static_cast<std::size_t>(std::max(1.0, std::max(1.0, 2 * time_constant) * rate));
  plan.seconds = static_cast<std::size_t>((chapter + 1) * rate) / plan.second + 1;
  plan.longest_gap = std::max(gap_ticks * plan.period, std::min(time_constant / 10, 0.1));
  plan.settling = std::clamp(7 * time_constant, 0.05, 20.0);
}

}  // namespace

const Channel* find_channel(std::span<const Channel> channels, Signal signal) {
  const auto found = std::ranges::find(channels, signal, &Channel::signal);
  return found == channels.end() ? nullptr : &*found;
}

Model without_periodic(Model model, std::vector<std::string>& left_out) {
  for (std::size_t e = 0; e < effect_count; ++e) {
    if (!effect_catalogue()[e].periodic || !model.includes(e)) continue;
    left_out.emplace_back(effect_catalogue()[e].id);
    model.exclude(e);
  }
  return model;
}

LivePlan live_plan(const Model& model, const FreeParameters& free, std::span<const Channel> channels, double rate,
                   double chapter) {
  LivePlan plan;
  plan.structure = model.structure();
  plan.moved = moved_by(free);
  plan.period = 1 / rate;
  const auto measured_fast = [&](Signal signal) {
    const Channel* channel = find_channel(channels, signal);
    return channel != nullptr && is_fast(*channel, plan.period);
  };
  refuse_unless_driven(model, measured_fast(model.input));
  plan.structure.measured_voltage = model.input != Signal::i_a && measured_fast(Signal::e_a);
  plan.structure.measured_load = measured_fast(Signal::torque);
  for (const Signal signal : {Signal::e_a, Signal::i_a, Signal::omega, Signal::torque}) {
    const Channel* channel = find_channel(channels, signal);
    if (channel == nullptr || signal == model.input) continue;
    const auto declared = model.noise.find(signal);
    const bool slow = !is_fast(*channel, plan.period);
    plan.outputs.push_back({signal, slow, channel->lsb, declared == model.noise.end() ? 0 : declared->second});
    if (slow) plan.longest_window = std::max(plan.longest_window, 2 * std::max(channel->window, channel->period) + 1);
  }
  for (auto& output : plan.outputs) {
    if (output.slow) output.offset = plan.moved.size() + plan.offsets++;
  }
  if (!find_channel(channels, Signal::omega) && !(find_channel(channels, Signal::i_a) && model.input != Signal::i_a)) {
    throw ModelError("model `" + model.name +
                     "` has nothing to be compared with: the bench measures neither omega nor i_a");
  }
  set_lengths(plan, model.mechanical_time_constant(), rate, chapter);
  return plan;
}

}  // namespace emtb
