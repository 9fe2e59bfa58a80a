#include "tests/blind/wide/experiments.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace emtb::blind::wide {
namespace {

/// Levels between -1 (or 0) and 1 over a run of a length.
struct Shapes {
  double length;   ///< [s] of a run
  double change;   ///< [s] that the bench needs for a change
  bool both_ways;  ///< levels of both signs
  double top;      ///< what the level 1 stands for

  double level(Draw& draw) const { return (both_ways ? draw.sign() : 1) * top * draw.within(0.15, 1); }

  std::vector<Knot> step(Draw& draw) const {
    const double at = level(draw);
    return {{0, 0}, {0.1 * length, 0}, {0.1 * length, at}, {0.7 * length, at}, {0.7 * length, 0}, {length, 0}};
  }

  std::vector<Knot> ramp(Draw&) const {
    if (!both_ways)
      return {{0, 0}, {0.1 * length, 0}, {0.5 * length, top}, {0.6 * length, top}, {0.9 * length, 0}, {length, 0}};
    return {{0, 0}, {0.05 * length, 0}, {0.3 * length, top}, {0.7 * length, -top}, {0.95 * length, 0}, {length, 0}};
  }

  std::vector<Knot> staircase(Draw& draw) const {
    std::vector<double> parts{0.3, 0.6, 1, 0.7, 0.15};
    if (both_ways) parts = {0.4, 1, 0.5, -0.3, -0.9, -0.6};
    const double each = 0.9 * length / static_cast<double>(parts.size());
    std::vector<Knot> knots{{0, 0}};
    double t = 0.05 * length, before = 0;
    for (const double part : parts) {
      const double at = part * top * draw.within(0.8, 1);
      knots.push_back({t, before});
      knots.push_back({t, at});
      before = at;
      t += each;
    }
    knots.insert(knots.end(), {{t, before}, {t, 0}, {length, 0}});
    return knots;
  }

  std::vector<Knot> random(Draw& draw) const {
    std::vector<Knot> knots{{0, 0}};
    double t = 0.05 * length, before = 0;
    while (t < 0.9 * length) {
      const double at = draw.chance(0.15) ? 0 : level(draw);
      knots.push_back({t, before});
      knots.push_back({t, at});
      before = at;
      t += change * draw.log_within(0.7, 6);
    }
    t = std::min(t, 0.98 * length);
    knots.insert(knots.end(), {{t, before}, {t, 0}, {length, 0}});
    return knots;
  }
};

Experiment draw_run(const Shapes& shapes, std::size_t kind, bool on_the_way, const std::string& prefix,
                    std::size_t number, Draw& draw) {
  constexpr std::array<std::string_view, 4> names{"step", "random", "ramp", "staircase"};
  std::vector<Knot> knots;
  switch (kind) {
    case 0:
      knots = shapes.step(draw);
      break;
    case 1:
      knots = shapes.random(draw);
      break;
    case 2:
      knots = shapes.ramp(draw);
      break;
    default:
      knots = shapes.staircase(draw);
  }
  const std::string name = prefix + std::to_string(number) + "_" + std::string(names[kind]);
  double begin = 0;
  if (on_the_way) {
    // In the middle of the first change: the driver is on its slope, the shaft gathers speed.
    const auto first = std::ranges::find_if(knots, [](const Knot& k) { return k.value != 0; });
    begin = kind == 2 ? 0.2 * shapes.length : first->t + draw.within(0.2, 0.7) * shapes.change;
  }
  return {name, Profile(name, std::move(knots)), begin};
}

}  // namespace

void draw_experiments(WideBench& bench, Draw& draw) {
  const Machine& m = bench.machine;
  const double loop = draw.within(0, 1);
  const bool counts = bench.encoder.as == EncoderAs::angle;
  if (loop < 0.25 && m.tau > 4 * bench.period) bench.loop = counts && draw.chance(0.5) ? Loop::position : Loop::speed;
  // A position loop goes both ways or not at all.
  if (bench.loop == Loop::position && !m.both_ways) bench.loop = Loop::speed;
  bench.traits["loop"] = bench.loop == Loop::open ? "open" : bench.loop == Loop::speed ? "speed" : "position";

  const double slowest = (bench.loop == Loop::position ? 6 : 1) * m.change();
  const double channels = static_cast<double>(bench.instruments.size() + 2);
  const double most = std::min(60'000.0 / channels, 20'000.0);
  const double rows = draw.log_within(std::min(40 * slowest / bench.period, most / 2), most);
  std::size_t wanted = draw.chance(0.12) ? 1 : 2 + draw.below(11);
  wanted = std::min(wanted, static_cast<std::size_t>(std::max(1.0, rows * bench.period / (10 * slowest))));
  bench.traits["runs"] = wanted == 1 ? "1" : wanted <= 4 ? "2 to 4" : "5 to 12";

  double top = m.voltage / m.gain;
  if (bench.loop == Loop::speed) top = 0.75 * m.speed;
  if (bench.loop == Loop::position) top = m.speed * m.tau * draw.log_within(2, 10);
  const Shapes shapes{.length = rows * bench.period / static_cast<double>(wanted),
                      .change = slowest,
                      .both_ways = m.both_ways,
                      .top = top};
  const bool on_the_way = bench.loop == Loop::open && draw.chance(0.2);
  bench.traits["start"] = on_the_way ? "on the way" : "at rest";
  const std::size_t judges = wanted / 3 + (wanted == 2 ? 1 : 0);
  const auto make = [&](std::vector<Experiment>& list, std::size_t count, const std::string& prefix) {
    for (std::size_t n = 0; n < count; ++n) {
      // Whoever has a single run made it of random levels or steps.
      const std::size_t kind = wanted == 1 ? 1 : prefix == "train" && n == 0 ? draw.below(2) : draw.below(4);
      list.push_back(draw_run(shapes, kind, on_the_way && draw.chance(0.7), prefix, n, draw));
    }
  };
  make(bench.train, wanted - judges, "train");
  make(bench.held_out, judges, "held");
  make(bench.secret, 1 + draw.below(2), "secret");
}

}  // namespace emtb::blind::wide
