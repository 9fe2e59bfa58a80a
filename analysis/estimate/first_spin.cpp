#include "analysis/estimate/first_spin.h"

#include <array>
#include <cmath>
#include <cstdio>

namespace emtb {
namespace {

constexpr double reversed_below = -0.2;  // of what was expected: beyond noise and offsets
constexpr double nothing_below = 0.2;    // of what was expected
constexpr double rest_beyond = 0.2;      // of what was expected: read while it stands

std::string shown(double value, const char* unit) {
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), "%.3g %s", value, unit);
  return text.data();
}

struct Means {
  double rest = 0;  // before the step
  double hold = 0;  // in the last half of it
};

std::optional<Means> means(const Run& run, Signal signal, const SpinExpectation& expected) {
  if (!run.has(signal)) return {};
  const Series& series = run.at(signal);
  Means sum;
  double at_rest = 0, held = 0;
  const double middle = (expected.from + expected.to) / 2;
  for (std::size_t k = 0; k < series.t.size(); ++k) {
    if (series.t[k] <= expected.from) {
      sum.rest += series.value[k];
      ++at_rest;
    } else if (series.t[k] - series.window >= middle && series.t[k] <= expected.to) {
      sum.hold += series.value[k];
      ++held;
    }
  }
  if (held == 0) return {};
  return Means{.rest = at_rest > 0 ? sum.rest / at_rest : 0, .hold = sum.hold / held};
}

}  // namespace

SpinVerdict judge_first_spin(const Run& run, const SpinExpectation& expected) {
  SpinVerdict verdict;
  const auto e_a = means(run, Signal::e_a, expected);
  const auto i_a = means(run, Signal::i_a, expected);
  const auto omega = means(run, Signal::omega, expected);
  const auto tell = [&](const char* name, const char* unit, const std::optional<Means>& m) {
    if (m)
      verdict.measured.push_back(std::string(name) + " " + shown(m->hold, unit) + ", at rest " + shown(m->rest, unit));
    if (!m) verdict.unknown.push_back(std::string(name) + " is not measured");
  };
  tell("e_a", "V", e_a);
  tell("i_a", "A", i_a);
  tell("omega", "rad/s", omega);

  /// Compares a mean with what it should be. @return whether it can be believed
  const auto compare = [&](const char* name, const char* unit, const Means& m, double wanted, const char* nothing,
                           const char* scale) {
    const double ratio = m.hold / wanted;
    const std::string is = std::string(name) + " reads " + shown(m.hold, unit) + ", not " + shown(wanted, unit) + ": ";
    if (std::abs(m.rest / wanted) > rest_beyond) {
      verdict.wrong.push_back(std::string(name) + " reads " + shown(m.rest, unit) +
                              " while the motor stands: set its offset, or see what drives the bench");
    } else if (ratio < reversed_below) {
      verdict.wrong.push_back(is + "its sign is wrong. Swap its two wires, or change the sign of its scale");
    } else if (ratio < nothing_below) {
      verdict.wrong.push_back(is + nothing);
    } else if (std::abs(ratio - 1) > expected.tolerance) {
      verdict.wrong.push_back(is + "its scale is off by a factor of " + shown(ratio, "") + scale);
    } else {
      return true;
    }
    return false;
  };

  bool voltage = false;
  if (e_a && expected.driver_gain) {
    voltage = compare("e_a", "V", *e_a, *expected.driver_gain * expected.u_ref,
                      "no voltage arrives. Is the driver on, its enable given, the reference's wire where it belongs?",
                      ". See the channel's scale, or motor.driver_gain");
  } else if (e_a) {
    verdict.unknown.push_back("the scale of e_a: motor.driver_gain is not in the bench file");
    voltage = e_a->hold * expected.u_ref > 0;
    if (!voltage)
      verdict.wrong.push_back("e_a reads " + shown(e_a->hold, "V") + ": no voltage arrives, or its wires are swapped");
  }
  if (!voltage) return verdict;  // what follows would blame wires that are right

  bool current = !i_a;
  if (i_a) {
    const double along = i_a->hold * (e_a->hold > 0 ? 1 : -1);
    if (along < -std::abs(i_a->rest)) {
      verdict.wrong.push_back(
          "i_a reads " + shown(i_a->hold, "A") +
          " while the driver drives: its sign is wrong. Swap its two wires, or change the sign of its scale");
    } else if (!(along > 2 * std::abs(i_a->rest)) || along == 0) {
      verdict.wrong.push_back("i_a reads " + shown(i_a->hold, "A") +
                              ", as it does at rest: is the meter in the armature circuit, its fuse whole?");
    } else if (expected.R_a && *expected.R_a * along > (1 + expected.tolerance) * std::abs(e_a->hold)) {
      verdict.wrong.push_back("i_a reads " + shown(i_a->hold, "A") + ", but " + shown(e_a->hold, "V") + " through " +
                              shown(*expected.R_a, "ohm") + " give " + shown(e_a->hold / *expected.R_a, "A") +
                              " at most: its scale is too large, or motor.R_a");
    } else {
      current = true;
    }
    verdict.unknown.push_back("whether i_a reads too little: a motor without a load draws hardly any");
  }
  if (!omega || !current) return verdict;

  if (!expected.R_a || !expected.K_b || !i_a) {
    verdict.unknown.push_back("the scale of omega: it takes i_a, and motor.R_a and motor.K_b in the bench file");
    if (omega->hold * e_a->hold <= 0) {
      verdict.wrong.push_back("omega reads " + shown(omega->hold, "rad/s") +
                              ": its sign is wrong, or the motor stands");
    }
    return verdict;
  }
  const double emf = e_a->hold - *expected.R_a * i_a->hold;
  if (emf / e_a->hold < expected.tolerance) {
    verdict.wrong.push_back(
        "the motor does not turn: R_a i_a takes all of e_a. Is the brake off? Then raise spin.u_ref");
    return verdict;
  }
  compare("omega", "rad/s", *omega, emf / *expected.K_b,
          "the motor turns, the tacho says not. See its wires and its coupling",
          ". See the channel's scale, or motor.K_b");
  return verdict;
}

}  // namespace emtb
