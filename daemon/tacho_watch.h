#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>

#include "config/bench.h"
#include "daemon/safety.h"

namespace emtb {

/// Whether the tacho can be believed. Without it nobody sees a motor run away.
///
///     back-EMF:  e_a - R_a i_a = K_b ω
///
/// Beyond `emf` the motor turns for certain; a tacho that says then that it stands is dead (wire, coupling), one that
/// turns the other way is reversed. A motor held by stiction has no back-EMF, whatever its voltage: e_a = R_a i_a. A
/// slow meter's i_a is a mean over its window: e_a and ω are taken over that same window, or else each step of e_a
/// would look like a motor that turns. What R_a i_a may be wrong by (a hot winding, brushes) belongs into `emf`; a
/// back-EMF against e_a is never believed, since a meter that reads rms shows one on a motor that stands. It takes
/// `time` of it to trip.
///
/// Pure: no clock, no thread, no allocation.
class TachoWatch {
 public:
  /// @param R_a [ohm]
  TachoWatch(const BenchConfig::Tacho& settings, double R_a) noexcept : settings_(settings), R_a_(R_a) {}

  /// Forgets all; for a device that is started anew.
  void restart() noexcept;

  /// @param window [s] of an i_a reading; 0: an instant
  /// @return dead_tacho or reversed_tacho with the back-EMF as its value, or none.
  Trip take(const Reading& reading, double window) noexcept;

 private:
  static constexpr double bin_length = 0.01;  // [s]
  static constexpr std::size_t bins = 1024;   // 10 s: the longest window that a meter may have, and its delay

  struct Bin {
    std::int64_t number = -1;                                                      // time / bin_length
    double e_a = 0;                                                                // [V] sum
    double count = 0;                                                              // of e_a
    double slowest = std::numeric_limits<double>::infinity(), fastest = -slowest;  // [rad/s]
  };

  static std::int64_t number_of(double t) noexcept;
  Bin& bin(std::int64_t number) noexcept { return bins_[static_cast<std::size_t>(number) % bins]; }
  Bin& begun(double t) noexcept;
  Trip judge(const Reading& i_a, double window) noexcept;

  BenchConfig::Tacho settings_;
  double R_a_;
  std::array<Bin, bins> bins_{};
  Fault suspicion_ = Fault::none;
  double since_ = 0;  // [s]
};

}  // namespace emtb
