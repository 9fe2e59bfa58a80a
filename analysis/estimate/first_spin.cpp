#include "analysis/estimate/first_spin.h"

#include <array>
#include <cmath>
#include <cstdio>

namespace emtb {
namespace {

// Shares of what was expected. By hand: beyond the noise and the offsets of real instruments
// (FirstSpin.FindsNothingWrongWithAHealthyBench), far from what a wrong wire or scale makes.
constexpr double reversed_below = -0.2;
constexpr double nothing_below = 0.2;
constexpr double rest_beyond = 0.2;  // read while it stands
constexpr double above_rest = 2;     // times what the current reads at rest: something flows

std::string shown(double value, const char* unit) {
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), "%.3g %s", value, unit);
  return text.data();
}

/// What an instrument read in the mean.
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

/// A mean, what it should be, and what to say where it is not.
struct Check {
  const char* name = nullptr;
  const char* unit = nullptr;
  Means seen;
  double wanted = 0;
  const char* if_nothing = nullptr;
  const char* if_scale = nullptr;
};

/// Checks the instruments one after the other: each is needed to judge the next.
class FirstSpin {
 public:
  FirstSpin(const Run& run, const SpinExpectation& expected)
      : expected_(expected),
        e_a_(means(run, Signal::e_a, expected)),
        i_a_(means(run, Signal::i_a, expected)),
        omega_(means(run, Signal::omega, expected)) {
    tell("e_a", "V", e_a_);
    tell("i_a", "A", i_a_);
    tell("omega", "rad/s", omega_);
  }

  SpinVerdict verdict() && {
    // Where an instrument is wrong, what follows would blame wires that are right.
    if (voltage_is_right() && current_is_right()) check_speed();
    return std::move(verdict_);
  }

 private:
  void tell(const char* name, const char* unit, const std::optional<Means>& m) {
    if (m) {
      verdict_.measured.push_back(std::string(name) + " " + shown(m->hold, unit) + ", at rest " + shown(m->rest, unit));
    } else {
      verdict_.unknown.push_back(std::string(name) + " is not measured");
    }
  }

  /// @return whether the mean can be believed
  bool holds(const Check& c) {
    const double ratio = c.seen.hold / c.wanted;
    const std::string name = c.name;
    const std::string is = name + " reads " + shown(c.seen.hold, c.unit) + ", not " + shown(c.wanted, c.unit) + ": ";
    if (std::abs(c.seen.rest / c.wanted) > rest_beyond) {
      verdict_.wrong.push_back(name + " reads " + shown(c.seen.rest, c.unit) +
                               " while the motor stands: set its offset, or see what drives the bench");
    } else if (ratio < reversed_below) {
      verdict_.wrong.push_back(is + "its sign is wrong. Swap its two wires, or change the sign of its scale");
    } else if (ratio < nothing_below) {
      verdict_.wrong.push_back(is + c.if_nothing);
    } else if (std::abs(ratio - 1) > expected_.tolerance) {
      verdict_.wrong.push_back(is + "its scale is off by a factor of " + shown(ratio, "") + c.if_scale);
    } else {
      return true;
    }
    return false;
  }

  bool voltage_is_right() {
    if (!e_a_) return false;
    if (expected_.driver_gain) {
      return holds({.name = "e_a",
                    .unit = "V",
                    .seen = *e_a_,
                    .wanted = *expected_.driver_gain * expected_.u_ref,
                    .if_nothing = "no voltage arrives. Is the driver on, its enable given, the reference's wire "
                                  "where it belongs?",
                    .if_scale = ". See the channel's scale, or motor.driver_gain"});
    }
    verdict_.unknown.push_back("the scale of e_a: motor.driver_gain is not in the bench file");
    if (e_a_->hold * expected_.u_ref > 0) return true;
    verdict_.wrong.push_back("e_a reads " + shown(e_a_->hold, "V") + ": no voltage arrives, or its wires are swapped");
    return false;
  }

  bool current_is_right() {
    if (!i_a_) return true;
    const double along = i_a_->hold * (e_a_->hold > 0 ? 1 : -1);
    const std::string reads = "i_a reads " + shown(i_a_->hold, "A");
    bool right = false;
    if (along < -std::abs(i_a_->rest)) {
      verdict_.wrong.push_back(
          reads + " while the driver drives: its sign is wrong. Swap its two wires, or change the sign of its scale");
    } else if (!(along > above_rest * std::abs(i_a_->rest)) || along == 0) {
      verdict_.wrong.push_back(reads + ", as it does at rest: is the meter in the armature circuit, its fuse whole?");
    } else if (expected_.R_a && *expected_.R_a * along > (1 + expected_.tolerance) * std::abs(e_a_->hold)) {
      verdict_.wrong.push_back(reads + ", but " + shown(e_a_->hold, "V") + " through " + shown(*expected_.R_a, "ohm") +
                               " give " + shown(e_a_->hold / *expected_.R_a, "A") +
                               " at most: its scale is too large, or motor.R_a");
    } else {
      right = true;
    }
    verdict_.unknown.emplace_back("whether i_a reads too little: a motor without a load draws hardly any");
    return right;
  }

  void check_speed() {
    if (!omega_) return;
    if (!expected_.R_a || !expected_.K_b || !i_a_) {
      verdict_.unknown.emplace_back("the scale of omega: it takes i_a, and motor.R_a and motor.K_b in the bench file");
      if (omega_->hold * e_a_->hold <= 0) {
        verdict_.wrong.push_back("omega reads " + shown(omega_->hold, "rad/s") +
                                 ": its sign is wrong, or the motor stands");
      }
      return;
    }
    const double emf = e_a_->hold - *expected_.R_a * i_a_->hold;
    if (emf / e_a_->hold < expected_.tolerance) {
      verdict_.wrong.emplace_back(
          "the motor does not turn: R_a i_a takes all of e_a. Is the brake off? Then raise spin.u_ref");
      return;
    }
    holds({.name = "omega",
           .unit = "rad/s",
           .seen = *omega_,
           .wanted = emf / *expected_.K_b,
           .if_nothing = "the motor turns, the tacho says not. See its wires and its coupling",
           .if_scale = ". See the channel's scale, or motor.K_b"});
  }

  const SpinExpectation& expected_;
  std::optional<Means> e_a_, i_a_, omega_;
  SpinVerdict verdict_;
};

}  // namespace

SpinVerdict judge_first_spin(const Run& run, const SpinExpectation& expected) {
  return FirstSpin(run, expected).verdict();
}

}  // namespace emtb
