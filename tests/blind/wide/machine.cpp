#include "tests/blind/wide/machine.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace emtb::blind::wide {
namespace {

struct Range {
  double low, high;
  double from(Draw& draw) const { return draw.log_within(low, high); }
};

/// What machines of a kind have in common.
struct Class {
  const char* kind;
  Range voltage;  ///< [V]
  Range power;    ///< [W]
  Range speed;    ///< [rad/s]
  Range tau;      ///< [s]
  Range drop;     ///< share of the voltage that falls over R at rated current
  Range losses;   ///< share of rated torque that B takes at full speed
};

constexpr std::array classes{
    Class{"small_servo", {6, 24}, {0.5, 5}, {200, 900}, {0.004, 0.05}, {0.15, 0.4}, {0.03, 0.15}},
    Class{"gear_motor", {6, 24}, {2, 60}, {4, 40}, {0.015, 0.15}, {0.15, 0.4}, {0.1, 0.4}},
    Class{"bench_100V", {60, 120}, {100, 400}, {100, 200}, {0.05, 0.4}, {0.1, 0.3}, {0.02, 0.1}},
    Class{"big_dc", {220, 440}, {5e3, 3e4}, {100, 180}, {0.05, 0.5}, {0.04, 0.1}, {0.01, 0.05}},
    Class{"linear_axis", {12, 48}, {20, 200}, {0.1, 1}, {0.02, 0.15}, {0.1, 0.3}, {0.1, 0.4}},
};

}  // namespace

double Machine::change() const { return std::isfinite(slew) ? std::max(tau, voltage / slew) : tau; }

Machine draw_machine(Draw& draw) {
  const Class& c = classes[draw.below(classes.size())];
  Machine m;
  m.kind = c.kind;
  m.linear = m.kind == "linear_axis";
  m.voltage = c.voltage.from(draw);
  m.current = c.power.from(draw) / m.voltage;
  m.speed = c.speed.from(draw);
  m.tau = c.tau.from(draw);
  const double drop = c.drop.from(draw), losses = c.losses.from(draw);
  m.R = drop * m.voltage / m.current;
  m.K = (m.voltage - losses * drop * m.voltage) / m.speed;
  m.torque = m.K * m.current;
  m.B = losses * m.torque / m.speed;
  m.J = m.tau * (m.K * m.K / m.R + m.B);
  m.both_ways = draw.chance(0.6);
  m.gain = m.voltage / draw.one_of({1, 5, 6, 10, m.voltage});
  if (draw.chance(0.6)) m.slew = m.voltage / (m.tau * (draw.chance(0.5) ? draw.within(0.2, 1) : draw.within(2, 8)));
  return m;
}

}  // namespace emtb::blind::wide
