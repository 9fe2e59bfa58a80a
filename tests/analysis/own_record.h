#pragma once

#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/record/record.h"
#include "model/simulation.h"
#include "tests/analysis/synthetic.h"

namespace emtb::synthetic {

/// The servo as it is: its truth as a model.
inline Model true_servo() {
  Model m = servo_model();
  const Truth truth;
  m.at(0).value = truth.R_a;
  m.at(1).value = truth.K_b;
  m.at(2).value = truth.K_m;
  m.at(3).value = truth.B;
  m.at(4).value = truth.J;
  return m;
}

/// What an instrument adds to a reading, in units of its sigma.
struct NoiseColour {
  double rho = 0;          ///< from one reading to the next, first order
  double white_share = 0;  ///< of the variance: white noise on top
};

/// Speed and current of a servo over 10 s at 100 Hz, driven by its reference, as a model makes them: nothing but the
/// noise is wrong with it.
class OwnRecord {
 public:
  static constexpr double sigma_omega = 0.5, sigma_i_a = 0.05;  ///< [rad/s], [A] by hand: 0.3 % and 3 % of the range

  /// @param lowest reference; above 0 the shaft turns in one direction throughout, and turned before
  explicit OwnRecord(const Model& truth, double lowest = -3) {
    std::vector<Hold> plan;
    for (int n = 0; n < 40; ++n) plan.push_back({0.25, 0.5 * (3 + lowest) + 0.5 * (3 - lowest) * std::sin(2.4 * n)});
    Run run = record({}, plan, 1e-2);
    run.signals.erase(Signal::e_a);
    records_.push_back({observe_run(run, truth)});
    Excitation& x = records_[0].excitation;
    x.initial = {};
    if (lowest > 0) x.initial.omega = 4 * plan.front().u_ref / Truth{}.K_b;
    x.longest_step = 2.5e-3;  // errs by far less than the noise
    simulate<double>(records_[0].structure(truth), truth.values(), x, exact_);
    for (Observation& o : records_[0].observations) {
      o.sigma.assign(o.size(), o.signal == Signal::omega ? sigma_omega : sigma_i_a);
    }
    with_noise(1);
  }

  /// Read anew, the same on every machine for a seed.
  const std::vector<Record>& with_noise(unsigned seed, const NoiseColour& colour = {}) {
    for (Observation& o : records_[0].observations) {
      const unsigned own = 4 * seed + (o.signal == Signal::omega ? 0 : 2);
      const std::vector<double> slow = coloured(o.size(), colour.rho, own), white = coloured(o.size(), 0, own + 1);
      for (std::size_t k = 0; k < o.size(); ++k) {
        const double noise = std::sqrt(1 - colour.white_share) * slow[k] + std::sqrt(colour.white_share) * white[k];
        o.value.edit()[k] = reading_of(o.signal, exact_)[o.last[k]] + o.sigma[k] * noise;
      }
    }
    return records_;
  }

  /// Read without noise, but with an error that is a function of (t, simulated speed).
  template <class Error>
  const std::vector<Record>& with_error(Signal signal, const Error& error) {
    for (Observation& o : records_[0].observations) {
      for (std::size_t k = 0; k < o.size(); ++k) {
        const std::size_t at = o.last[k];
        o.value.edit()[k] = reading_of(o.signal, exact_)[at];
        if (o.signal == signal) o.value.edit()[k] += error(records_[0].excitation.t[at], exact_.omega[at]);
      }
    }
    return records_;
  }

  const std::vector<Record>& records() const { return records_; }

 private:
  std::vector<Record> records_;
  Trajectory<double> exact_;
};

}  // namespace emtb::synthetic
