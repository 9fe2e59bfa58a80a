#include "tests/blind/wide/garbage.h"

#include <algorithm>
#include <cmath>

namespace emtb::blind::wide {
namespace {

/// A signal that is recorded and is no input; the current where it is there.
Signal some_output(const Run& run, Draw& draw) {
  std::vector<Signal> list;
  for (const Signal s : {Signal::i_a, Signal::omega, Signal::theta}) {
    if (run.has(s)) list.push_back(s);
  }
  return list[draw.below(list.size())];
}

/// A signal that is no angle: clipping, spikes and holds are of those.
std::optional<Signal> some_reading(const Run& run, Draw& draw) {
  std::vector<Signal> list;
  for (const Signal s : {Signal::i_a, Signal::omega}) {
    if (run.has(s) && run.at(s).value.size() > 200) list.push_back(s);
  }
  if (list.empty()) return std::nullopt;
  return list[draw.below(list.size())];
}

void multiply(WideCase& c, Signal signal, double factor) {
  for (auto* runs : {&c.train, &c.held_out}) {
    for (Run& run : *runs) {
      for (double& v : run.signals.at(signal).value.edit()) v *= factor;
      run.signals.at(signal).lsb *= std::abs(factor);
    }
  }
}

Garbage wrong_unit(WideCase& c, Draw& draw) {
  const Run& run = c.train.front();
  const Signal signal = some_output(run, draw);
  const bool current = signal == Signal::i_a;
  const double factor = current ? 1000 : signal == Signal::omega ? 60 / 6.283185307179586 : 360 / 6.283185307179586;
  const bool other_speed = signal != Signal::i_a && run.has(Signal::omega) && run.has(Signal::theta);
  multiply(c, signal, factor);
  // Tight bounds are a word about the scale, too: R_a or K_b would have to leave them.
  return {"scale",
          std::string(info(signal).name) + (current                   ? " in mA"
                                            : signal == Signal::omega ? " in 1/min"
                                                                      : " in degrees"),
          other_speed || c.bench.bounds < factor};
}

Garbage wrong_sign(WideCase& c, Draw& draw) {
  const Signal signal = some_output(c.train.front(), draw);
  multiply(c, signal, -1);
  return {"sign", std::string(info(signal).name) + " with the other sign", true};
}

Garbage clipped(Series& s, std::string_view name) {
  double largest = 0;
  for (const double v : s.value) largest = std::max(largest, std::abs(v));
  for (double& v : s.value.edit()) v = std::clamp(v, -0.5 * largest, 0.5 * largest);
  return {"clipped", std::string(name) + " ends at half of what it reaches", true};
}

Garbage stuck(Series& s, std::string_view name, Draw& draw) {
  const std::size_t n = s.value.size(), from = n / 10 + draw.below(n / 3), count = n / 3;
  for (std::size_t k = from; k < from + count; ++k) s.value.edit()[k] = s.value[from];
  return {"held", std::string(name) + " stands still for a third of the run", true};
}

Garbage spiked(Series& s, std::string_view name, Draw& draw) {
  double largest = 0;
  for (const double v : s.value) largest = std::max(largest, std::abs(v));
  for (int n = 0; n < 5; ++n) s.value.edit()[draw.below(s.value.size())] = draw.sign() * largest * draw.within(3, 10);
  return {"spikes", std::string(name) + " has five spikes", true};
}

Garbage gap(Run& run) {
  const double at = 0.5 * run.duration();
  for (auto& [signal, s] : run.signals) {
    for (double& t : s.t.edit()) t += t > at ? 100 : 0;
  }
  return {"gap", "100 s are missing in the middle", true};
}

}  // namespace

Garbage plant_garbage(WideCase& c, Draw& draw) {
  Run& run = c.train.front();
  switch (draw.below(9)) {
    case 0:
    case 1:
      return wrong_unit(c, draw);
    case 2:
      return wrong_sign(c, draw);
    case 3:
      return gap(run);
    case 4:
      c.train.push_back(run);
      c.train.back().name += "_again";
      return {"duplicate", "a run is listed twice", true};
    case 5:
      c.held_out.push_back(run);
      c.held_out.back().name += "_again";
      return {"duplicate", "a run is in training and held out", true};
    default:
      break;
  }
  const auto signal = some_reading(run, draw);
  if (!signal) return gap(run);
  Series& s = run.signals.at(*signal);
  const auto name = info(*signal).name;
  switch (draw.below(3)) {
    case 0:
      return clipped(s, name);
    case 1:
      return stuck(s, name, draw);
    default:
      return spiked(s, name, draw);
  }
}

}  // namespace emtb::blind::wide
