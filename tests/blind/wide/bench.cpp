#include "tests/blind/wide/bench.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "tests/blind/text.h"
#include "tests/blind/wide/experiments.h"

namespace emtb::blind::wide {
namespace {

constexpr std::array rates{20.0,  25.0,  40.0,   50.0,   80.0,   100.0,  125.0,  200.0,   250.0,
                           400.0, 500.0, 1000.0, 2000.0, 2500.0, 4000.0, 5000.0, 10000.0, 20000.0};

/// A converter whose range leaves room above the largest value: 8 to 24 bits, and noise of its own.
Instrument converter(Signal signal, double largest, Draw& draw) {
  Instrument i;
  i.signal = signal;
  const double bits = draw.one_of({8, 10, 10, 12, 12, 12, 14, 16, 16, 24});
  const double range = 2 * largest * draw.within(1.1, 2);
  i.lsb = range / std::exp2(bits);
  i.noise = largest * draw.log_within(2e-4, 1e-2);
  return i;
}

void draw_speed(WideBench& bench, Draw& draw) {
  const Machine& m = bench.machine;
  const double lot = m.linear ? 0.6 : draw.within(0, 1);
  const bool tacho = lot < 0.45 || lot > 0.85, encoder = lot >= 0.45;
  if (tacho) bench.instruments.push_back(converter(Signal::omega, 1.15 * m.speed, draw));
  bench.traits["speed"] = tacho && encoder ? "both" : tacho ? "tacho" : "encoder";
  if (!encoder) return;
  const double turn = m.linear ? 0.01 : 6.283185307179586;  // [m] a turn of a spindle
  const double lines = std::round(draw.log_within(64, 20000));
  bench.encoder.step = turn / lines;
  bench.encoder.as = !tacho && draw.chance(0.25) ? EncoderAs::speed : EncoderAs::angle;
  bench.encoder.absolute = draw.chance(0.5);
  bench.traits["counts"] = lines < 500 ? "64 to 500" : lines < 4000 ? "500 to 4000" : "4000 to 20000";
  if (bench.encoder.as == EncoderAs::speed) bench.traits["speed"] = "counted speed";
}

void draw_rate(WideBench& bench, Draw& draw) {
  const Machine& m = bench.machine;
  const double fastest = 300 / m.change(), slowest = 4 / m.tau;
  const double wanted = draw.log_within(std::min(slowest, fastest), fastest);
  const auto* best = std::ranges::min_element(rates, {}, [&](double r) { return std::abs(std::log(r / wanted)); });
  bench.period = 1 / *best;
  bench.traits["rate"] = *best < 100 ? "20 to 80 Hz" : *best < 1000 ? "100 to 500 Hz" : "1 to 20 kHz";
  if (draw.chance(0.25)) bench.jitter = draw.log_within(0.01, 0.2);
  bench.traits["jitter"] = bench.jitter > 0 ? "yes" : "no";
  bench.read_after = draw.chance(0.5);
  bench.traits["read"] = bench.read_after ? "after" : "before";
}

void draw_electrical(WideBench& bench, Draw& draw) {
  const Machine& m = bench.machine;
  const double peak = m.voltage / m.R * (m.both_ways ? 1.6 : 1);
  const bool current = draw.chance(0.75);
  bench.traits["current"] = current ? "yes" : "no";
  if (current) {
    bench.instruments.push_back(converter(Signal::i_a, peak, draw));
    // A multimeter beside the log: its readings are means, and most cells are empty.
    const double period = draw.one_of({0.2, 0.4, 0.5, 1});
    if (draw.chance(0.12) && period > 20 * bench.period && period < 10 * m.change()) {
      bench.instruments.back().period = period;
      bench.traits["current"] = "slow meter";
    }
  }
  const bool terminal = draw.chance(0.4);
  if (terminal) bench.instruments.push_back(converter(Signal::e_a, m.voltage, draw));
  bench.traits["e_a"] = terminal ? "yes" : "no";
  bench.logs_reference = !terminal || draw.chance(0.75);
  bench.traits["input"] = bench.logs_reference ? "u_ref" : "e_a";
  const bool gauge = current && draw.chance(0.15);
  if (gauge) bench.instruments.push_back(converter(Signal::torque, 1.2 * m.torque, draw));
  bench.traits["gauge"] = gauge ? "yes" : "no";
  bench.resistance_known = !current && draw.chance(0.5);
  bench.traits["scale"] = current ? "fixed by the current" : bench.resistance_known ? "R_a known" : "free";
}

void draw_imperfections(WideBench& bench, Draw& draw) {
  const Machine& m = bench.machine;
  const bool coloured = draw.chance(0.4);
  for (Instrument& i : bench.instruments) {
    if (coloured && i.period == 0) i.correlation = draw.within(0.2, 0.97);
  }
  bench.traits["noise"] = coloured ? "coloured" : "white";
  const bool late = draw.chance(0.25), held = draw.chance(0.08);
  bench.traits["sensor delay"] = late ? "within a row" : "no";
  bench.traits["hold"] = held ? "yes" : "no";
  if (!bench.instruments.empty()) {
    Instrument& one = bench.instruments[draw.below(bench.instruments.size())];
    if (late) one.delay = draw.within(0.2, 0.9) * bench.period;
    if (held && one.period == 0) one.hold = 2 + static_cast<int>(draw.below(3));
  } else if (late) {
    bench.encoder.delay = draw.within(0.2, 0.9) * bench.period;
  }
  const bool error = draw.chance(0.3);
  bench.traits["model error"] = error ? "yes" : "no";
  if (error) {
    // A few percent of the torque that the bench usually needs: losses, and what accelerates it.
    bench.model_error = draw.log_within(0.01, 0.05) * (m.B * m.speed + 0.2 * m.torque);
    bench.model_error_time = m.change() * draw.log_within(1, 8);
  }
  const bool wide_bounds = draw.chance(0.5);
  bench.bounds = wide_bounds ? 100 : 5;
  bench.traits["bounds"] = wide_bounds ? "10^4 wide" : "tight";
  bench.csv = draw.chance(0.7);
  bench.traits["file"] = bench.csv ? "csv" : "h5";
}

void make_plant(WideBench& bench, Draw& draw) {
  const Machine& m = bench.machine;
  auto& plant = bench.plant;
  plant.laws = draw.chance(0.5) ? simulated::Laws::usual : simulated::Laws::other;
  plant.motor = {.R_a = m.R, .K_b = m.K, .K_m = m.K, .B = m.B, .J = m.J};
  plant.driver = {
      .gain = m.gain, .rise = m.slew, .fall = m.slew, .min = m.both_ways ? -m.voltage : 0, .max = m.voltage};
  plant.friction.law = draw.chance(0.5) ? simulated::FrictionLaw::bristle : simulated::FrictionLaw::hard;
  // A bristle that gives as little as a bearing does: far below what the shaft turns in a tau.
  plant.friction.deflection = 1e-4 * m.speed * m.tau;
  // What a gauge reads is an input: a brake that nobody is asked about.
  if (bench.find(Signal::torque) != nullptr) {
    if (draw.chance(0.5)) {
      plant.load.brake = 0.25 * m.torque;
    } else {
      plant.load.eddy_torque = 0.4 * m.torque;
      plant.load.eddy_omega = 0.7 * m.speed;
    }
  }
  bench.traits["laws"] = plant.laws == simulated::Laws::usual ? "usual" : "other";
  bench.traits["machine"] = m.kind;
  bench.traits["ways"] = m.both_ways ? "both" : "one";
  bench.traits["driver"] = std::isfinite(m.slew) ? "slopes" : "at once";
}

}  // namespace

double Instrument::sigma() const { return std::hypot(noise, lsb / std::sqrt(12)); }

const Instrument* WideBench::find(Signal signal) const {
  const auto found = std::ranges::find(instruments, signal, &Instrument::signal);
  return found == instruments.end() ? nullptr : &*found;
}

Instrument* WideBench::find(Signal signal) { return const_cast<Instrument*>(std::as_const(*this).find(signal)); }

double WideBench::speed_sigma() const {
  if (const Instrument* tacho = find(Signal::omega)) return tacho->sigma();
  return encoder.step / (std::sqrt(6) * std::max(period, 0.1 * machine.tau));
}

WideBench draw_bench(Draw& draw) {
  WideBench bench;
  bench.machine = draw_machine(draw);
  draw_rate(bench, draw);
  draw_speed(bench, draw);
  draw_electrical(bench, draw);
  draw_imperfections(bench, draw);
  make_plant(bench, draw);
  draw_experiments(bench, draw);
  return bench;
}

}  // namespace emtb::blind::wide
