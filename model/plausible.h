#pragma once

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>

#include "hal/unit.h"
#include "model/effect.h"

namespace emtb {

/// Holds the values of an effect against the range in which it is that effect, and says the first that is beyond:
/// `tau is 0.19 s, below 10 s: grease does not warm up faster`. An effect states its range beside `apply`, in a
/// function `implausible(values, machine)`, as ratios to what the machine is and did, as times and speeds.
class Plausible {
 public:
  Plausible(const EffectInfo& effect, std::span<const double> values) : effect_(effect), values_(values) {}

  /// @param what it is, for people: `J`, `the largest speed`
  Plausible& at_most(std::size_t i, double most, std::string_view what) {
    if (said_.empty() && std::abs(values_[i]) >= most) said_ = text(i, "not below ", most, what);
    return *this;
  }
  Plausible& at_least(std::size_t i, double least, std::string_view what) {
    if (said_.empty() && values_[i] <= least) said_ = text(i, "not above ", least, what);
    return *this;
  }
  /// Of what follows from several parameters. @param unit of both
  Plausible& at_least(std::string_view quantity, double value, double least, std::string_view unit,
                      std::string_view what) {
    if (said_.empty() && !(value > least)) said_ = text(quantity, value, "not above ", least, unit, what);
    return *this;
  }
  Plausible& at_most(std::string_view quantity, double value, double most, std::string_view unit,
                     std::string_view what) {
    if (said_.empty() && !(value < most)) said_ = text(quantity, value, "not below ", most, unit, what);
    return *this;
  }

  /// Of a supply that the reference goes up to. Bench supplies and batteries sag, and few runs ask for all of one.
  Plausible& supply(std::size_t i, const Ranges& seen) {
    at_least(i, 0.7 * seen.supply, "the supply that the reference asks for");
    return at_most(i, 5 * seen.supply, "the supply that the reference asks for, five times");
  }

  /// Empty: all is within.
  operator std::string() const { return said_; }  // NOLINT: what an effect returns

 private:
  static std::string text(std::string_view quantity, double value, const char* where, double limit,
                          std::string_view unit, std::string_view what) {
    const auto number = [&](double x) {
      char digits[32];
      std::snprintf(digits, sizeof digits, "%.3g", x);
      return digits + with_space(unit);
    };
    return std::string(quantity) + " is " + number(value) + ", " + where + number(limit) + ", " + std::string(what);
  }
  std::string text(std::size_t i, const char* where, double limit, std::string_view what) const {
    const EffectParameter& p = effect_.parameter_list[i];
    return text(p.symbol, values_[i], where, limit, p.unit, what);
  }

  const EffectInfo& effect_;
  std::span<const double> values_;
  std::string said_;
};

}  // namespace emtb
