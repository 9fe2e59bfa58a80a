#include "tests/blind/wide/outside.h"

#include <algorithm>
#include <cmath>

namespace emtb::blind::wide::outside {

Nothing friction_bump(WideBench& b, double size, Draw draw) {
  const double top = 0.2 * b.machine.torque * size;
  const double at = b.machine.speed * draw.within(0.35, 0.7), width = at * draw.within(0.08, 0.15);
  b.plant.hidden_torque = [=](double omega, double, double) {
    const double x = (std::abs(omega) - at) / width;
    return std::copysign(top * std::exp(-x * x), omega);
  };
  return {};
}

Nothing sector_friction(WideBench& b, double size, Draw draw) {
  const double torque = 0.3 * b.machine.torque * size, from = draw.phase(), part = draw.within(0.15, 0.3);
  b.plant.hidden_torque = [=, small = 0.01 * b.machine.speed](double omega, double theta, double) {
    const double turn = (theta - from) / 6.283185307179586;
    return turn - std::floor(turn) < part ? torque * std::tanh(omega / small) : 0;
  };
  return {};
}

Nothing shaking(WideBench& b, double size, Draw draw) {
  const double torque = 0.15 * b.machine.torque * size, phase = draw.phase();
  const double swings = std::min(draw.log_within(0.7, 3) / b.machine.tau, 0.8 / b.period);  // [rad/s]
  b.plant.hidden_torque = [=](double, double, double t) { return torque * std::sin(swings * t + phase); };
  return {};
}

Nothing flux_hysteresis(WideBench& b, double size, Draw draw) {
  b.plant.motor.flux_hysteresis = std::min(0.05 * size, 0.4);
  b.plant.motor.coercive_current = b.machine.current * draw.within(0.1, 0.3);
  return {};
}

Nothing tacho_coupling(WideBench& b, double size, Draw) {
  b.plant.sensors.tacho_stick = 0.03 * b.machine.speed * size;
  return {};
}

Nothing brush_bounce(WideBench& b, double size, Draw draw) {
  const double more = b.machine.R * size;
  const double at = b.machine.speed * draw.within(0.4, 0.7), width = 0.05 * at;
  b.plant.hidden_drop = [=](double i, double omega, double) {
    return more * i / (1 + std::exp(-(std::abs(omega) - at) / width));
  };
  return {};
}

Nothing random_brake(WideBench& b, double size, Draw draw) {
  const double torque = 0.25 * b.machine.torque * size, every = b.machine.change() * draw.within(4, 10);
  const std::uint64_t seed = draw.seed();
  b.plant.hidden_torque = [=, small = 0.01 * b.machine.speed](double omega, double, double t) {
    const auto piece = static_cast<std::uint64_t>(std::max(t, 0.0) / every);
    const double lot = SplitMix64(seed ^ (piece * 0x9e3779b9U)).uniform();
    return lot < 0.35 ? torque * std::tanh(omega / small) : 0;
  };
  return {};
}

}  // namespace emtb::blind::wide::outside
