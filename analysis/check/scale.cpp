#include "analysis/check/scale.h"

#include <algorithm>
#include <cmath>

#include "analysis/check/readings.h"
#include "analysis/check/units.h"

namespace emtb {
namespace {

/// What a parameter may be: as the model says, widened by what a balance without effects may be off.
struct Range {
  double low = 0, high = HUGE_VAL;

  bool holds(double x) const { return x >= low && x <= high; }
};

std::optional<Range> range_of(const Model& model, std::string_view symbol) {
  const auto p = std::ranges::find(model.base, symbol, &Parameter::symbol);
  if (p == model.base.end()) return std::nullopt;
  Range r{p->min, p->max};
  if (p->fixed) r = {p->value / 2, p->value * 2};
  if (p->prior) {
    r.low = std::max(r.low, p->prior->value - 5 * p->prior->std);
    r.high = std::min(r.high, p->prior->value + 5 * p->prior->std);
  }
  return Range{r.low / 1.3, r.high * 1.3};
}

DataFinding scale_finding(Signal signal, const std::string& text) {
  return {{}, signal, Flaw::scale, 0, 0, text, true};
}

std::string in_unit(Signal signal, std::string_view unit) {
  return name_of(signal) + " seems to be in " + std::string(unit) + ". Say so with --map, unit: or scale:";
}

/// K_b by the voltage over K_m by the gauge is one in SI.
std::optional<DataFinding> by_gauge(const MotionWindows& w, const MotorBalance& b) {
  if (!w.torque || !w.voltage || w.voltage != Signal::e_a || !b.back_emf.sure() || !b.torque.sure())
    return std::nullopt;
  const double ratio = b.back_emf.value * b.torque.value;
  if (ratio > 0.4 && ratio < 2.5) return std::nullopt;
  const std::string start = "e_a over the speed gives " + short_number(b.back_emf.value) +
                            " V s/rad, torque over i_a " + short_number(1 / b.torque.value) +
                            " N m/A, which are the same in SI: ";
  if (const auto unit = milli_unit(ratio, 1.6)) {
    const Signal wrong = unit->factor > 1 ? Signal::i_a : Signal::torque;
    return scale_finding(wrong, start + in_unit(wrong, "thousandths (mA, mN m)"));
  }
  // Friction takes a part of the torque before the gauge sees it, so that K_m may be a few times too small.
  constexpr double may_be_friction = 8;
  if (ratio > 1 && ratio < may_be_friction) return std::nullopt;
  if (const auto unit = speed_unit(1 / ratio, 1.6)) {
    return scale_finding(*w.speed, start + in_unit(*w.speed, w.speed == Signal::omega ? unit->unit : "deg"));
  }
  if (ratio > 1) return std::nullopt;  // friction that grows with the load may take nearly all
  return scale_finding(Signal::torque, start + "one of the four has another scale");
}

/// The model's K_b against e_a over ω, its R_a against what the current takes of e_a.
std::optional<DataFinding> by_model(const MotionWindows& w, const MotorBalance& b, const Model& model) {
  if (!w.voltage || b.driven < 0.5) return std::nullopt;
  const bool commanded = *w.voltage == Signal::u_ref;
  if (commanded && !model.driver) return std::nullopt;
  const double gain = commanded ? model.driver->gain : 1;
  const auto K = range_of(model, "K_b"), R = range_of(model, "R_a");
  if (!K || !R || gain <= 0) return std::nullopt;
  const bool balanced = w.current && b.back_emf.sure();
  // Without a current the gain holds friction as well: it is K_b or more.
  const double k = gain * (balanced ? b.back_emf.value : b.gain);
  const double reach = balanced ? 1 : 3;
  const std::string source = commanded ? "u_ref times the driver's gain" : "e_a";
  if (k < K->low || k > K->high * reach) {
    const std::string start = source + " over the speed gives K_b " + short_number(k) + " V s/rad, the model allows " +
                              short_number(K->low * 1.3) + " to " + short_number(K->high / 1.3) + ": ";
    const double middle = std::sqrt(std::max(K->low, K->high * 1e-4) * K->high);
    // Of the units that would bring it between the bounds, the one that brings it nearest to their middle.
    std::optional<UnitFactor> best;
    for (const double guess : {9.549, 57.30, 1000.0, 0.1047, 0.1592, 0.01745, 60.0, 1e-3}) {
      const auto unit = speed_unit(guess, 1.01);
      if (!unit || !K->holds(k * unit->factor / (k * unit->factor > K->high ? reach : 1))) continue;
      const auto off = [&](double f) { return std::abs(std::log(k * f / middle)); };
      if (!best || off(unit->factor) < off(best->factor)) best = unit;
    }
    if (best) return scale_finding(*w.speed, start + in_unit(*w.speed, w.speed == Signal::omega ? best->unit : "deg"));
    return std::nullopt;
  }
  if (!balanced || !(b.resistance.t > 6)) return std::nullopt;
  const double r = gain * b.resistance.value;
  if (R->holds(r)) return std::nullopt;
  // The transients of a driver that is not measured bend R_a, but not a thousandfold.
  const double may_bend = commanded ? 6 : 3;
  for (const double too_large : {1000.0, 1e-3}) {
    const double mended = r * too_large;
    if (mended > R->low / 2 && mended < R->high * 2 && (r * may_bend < R->low || r > may_bend * R->high)) {
      return scale_finding(Signal::i_a, source + " over i_a gives R_a " + short_number(r) + " ohm, the model allows " +
                                            short_number(R->low * 1.3) + " to " + short_number(R->high / 1.3) + ": " +
                                            in_unit(Signal::i_a, too_large > 1 ? "mA" : "kA"));
    }
  }
  return std::nullopt;
}

}  // namespace

DataFindings wrong_scales(const MotionWindows& w, const MotorBalance& b, const Model* model) {
  if (w.all.size() < 20 || !w.speed) return {};
  if (model) {
    if (auto found = by_model(w, b, *model)) {
      found->by_bounds = true;
      return {*found};
    }
  }
  if (auto found = by_gauge(w, b)) return {*found};
  return {};
}

DataFindings unfixed_scale(const MotionWindows& w, const MotorBalance& b) {
  if (!w.speed || w.all.size() < 20) return {};
  if (w.torque && b.torque.sure() && b.back_emf.sure()) return {};
  DataFinding f =
      scale_finding(*w.speed, "nothing here fixes the scale of " + name_of(*w.speed) + (w.current ? " or i_a" : "") +
                                  ": see that the units are right; --model FILE holds them against its bounds");
  f.stops = false;
  return {f};
}

}  // namespace emtb
