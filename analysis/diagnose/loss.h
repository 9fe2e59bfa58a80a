#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "analysis/diagnose/likelihood.h"
#include "analysis/fit/residuals.h"
#include "analysis/record/noise_floor.h"
#include "analysis/record/record.h"
#include "hal/shared_column.h"
#include "hal/signal.h"

namespace emtb {

/// How far a model is from data, reading by reading: enough to say whether one model is better than another, and how
/// sure that is.
class Loss {
 public:
  explicit Loss(const Noise& noise);

  /// @param unseen the model was not fitted to these runs: they count in squares()
  void add(std::span<const Record> records, std::span<const Residuals> residuals, bool unseen = true);

  double mean_square(Signal signal) const;        ///< (RMSE/sigma)^2; 1 = noise floor
  std::map<Signal, double> mean_squares() const;  ///< of each signal
  double error() const;                           ///< sqrt(mean over signals)

  /// By how much the mean square of a signal may be off 1 where nothing is wrong: noise scatters it, and the floor
  /// itself is known no better than it is.
  double noise_error(Signal signal) const;

  /// What is left of a signal beyond its floor, as a share of how much its readings vary.
  double share_left(Signal signal) const;

  /// The most that neighbouring readings of one piece share, in the mean of their products, beyond what noise may: what
  /// a few rows show, and hundreds at rest hide in a mean over all. A spike shares nothing with its neighbours.
  double most_in_a_piece(Signal signal) const;

  /// The same as a share of how much the readings of the signal vary.
  double share_in_a_piece(Signal signal) const;

  std::vector<Signal> signals() const;

  /// Has a simulation blown up? What is left then counts as 1e15 floors.
  bool leaves_all_bounds() const { return leaves_all_bounds_; }

  const Squares& squares() const { return squares_; }  ///< for the model's quality

  /// Is the floor of a signal known only to be no higher?
  bool floor_is_upper_bound(Signal signal) const { return floors_.at(signal).upper_bound; }

  /// Or only to be no lower?
  bool floor_is_lower_bound(Signal signal) const { return floors_.at(signal).lower_bound; }

  std::optional<Quality> quality;  ///< of the model that leaves this; where it was asked for

  /// Mean square of `worse` less that of `better` on the same readings.
  ///
  /// With r the residuals of the better model and d what the worse one adds to them, the difference is mean(d^2 + 2 r
  /// d); only r is random. `noise_error` is its standard error if r is the instrument's noise: what chance alone could
  /// have brought. `block_error` takes r as it is, summed over pieces beyond which residuals are hardly correlated: it
  /// also counts what is still missing from the better model, which other experiments would have shown in other
  /// proportions. (The scatter of the whole difference over pieces would call an effect that acts at a few edges
  /// uncertain at 300 sigma.)
  struct Difference {
    double gain = 0;
    double noise_error = 0;
    double block_error = 0;
    /// The gain as a share of the mean square by which the models are apart: 1 for what is there, whatever else is
    /// missing beside it, -1 for what is not and only fits other runs.
    double there = 1;
  };
  static std::map<Signal, Difference> difference(const Loss& worse, const Loss& better);

 private:
  struct Readings {
    SharedColumn<float> residual;   ///< in units of sigma; a search holds those of many models side by side
    double squared = 0;             ///< their sum of squares
    std::vector<std::size_t> ends;  ///< of each piece: a tenth of a run, a second at most
    double sum = 0, squares = 0;    ///< of the readings themselves, in units of sigma

    double variance() const;
  };
  std::map<Signal, Readings> signals_;
  Squares squares_;
  Noise floors_;
  bool leaves_all_bounds_ = false;
};

/// What counts as a difference. Every wrong model is coloured and "significant" at 10^5 readings: materiality does the
/// work.
struct Materiality {
  double share = 0.10;  ///< of the excess mean square (RMSE^2/sigma^2 - 1) that must go
  double least = 0.10;  ///< of the mean square itself: a twentieth of the signal's error. Less is a name for what the
                        ///< law of another effect, the steps of a meter or the colour of the noise leaves
  double distinct = 0.02;  ///< the same, between two models of which each explains what the other does
  double errors = 2;       ///< standard errors of the gain under noise alone. An effect of z standard errors gains z^2,
                           ///< which noise scatters by 2 z: this asks for z > 4
  double edge_share = 0.04;  ///< the same, where another effect shapes the same edges: of two equal poles, a lag leaves
                             ///< 2.2 % to a delay; a delay of half the lag takes 4 %
  double edge_left = 0.04;   ///< of the excess mean square, all that may be left where less than that share is taken: a
                            ///< lag and a delay leave 4.8 to 12 % of what a lag alone leaves of two poles, the second a
                            ///< tenth of the first or its equal (computed from their steps)
  double law_share = 0.03;        ///< of the error that was taken away: so well is the law known that took it
  double there = 0.5;             ///< of what an effect changes has to be gained, unless that is most of what is there
  double remainder = 0.25;        ///< excess mean square that is called a remainder: 12 % above the floor
  double remainder_errors = 3;    ///< standard errors of a mean square under noise alone, for the same
  double remainder_share = 0.02;  ///< of how much the signal varies, for the same: no machine is known better
  double disturbance_share = 0.05;  ///< of how much the signal varies: what may be left without coming again
  double again = 0.15;  ///< of what is left beyond the floor: what has to come again, to be a law that has no name
  double far_off =
      0.1;  ///< of how much the signal varies: beyond it, sensitivities at the fitted values foretell little
  double mostly_model = 4;  ///< of a mean square: three quarters of it are the model's
  double in_a_piece = 1;    ///< of what neighbouring readings share: as much as their noise
  double nats = 3;          ///< by which Q must rise (likelihood.h): odds of twenty, after Madigan and Raftery (1994)
};

/// Is a model that leaves `a` likelier than one that leaves `b`? Where that was not asked for: is its error smaller?
bool likelier(const Loss& a, const Loss& b);

/// Does going from `without` to `with` remove something material from some signal, and make the error smaller?
bool worth_a_step(const Loss& without, const Loss& with, const Materiality& rule = {});

/// The same, and make the whole likelier; where that was not asked for, the error smaller?
bool material(const Loss& without, const Loss& with, const Materiality& rule = {});

/// Does going from `without` to `with` remove something material from some signal, counted as a share of what was too
/// much `before`?
bool takes_share(const Loss& before, double share, const Loss& without, const Loss& with, const Materiality& rule = {});

/// Is all gone that `without` leaves of the signal with the largest excess, but for a share, whatever noise adds?
bool takes_all_but(double share, const Loss& without, const Loss& with);

/// Is what goes from `without` to `with` more, in some signal, than the laws may be off by that took away the rest of
/// what was there `as_given`? No friction or driver keeps its formula to better than a small part of itself; but what
/// is gone to the noise with one effect more is no law's own error.
bool beyond_the_laws(const Loss& as_given, const Loss& without, const Loss& with, const Materiality& rule = {});

/// Is `other` as good as `best`: in every signal within 2 block standard errors, or not distinctly worse?
bool tied(const Loss& best, const Loss& other, const Materiality& rule = {});

/// By how much the largest mean square of a signal is above the floor; 0 where none is.
double largest_excess(const Loss& loss);
double largest_excess(const Loss& loss, std::span<const Signal> signals);

/// Is half of that gone? Two amplitudes can do a little of anything.
bool removes_most(const Loss& without, const Loss& with);

/// Is half of that gone, and that which is left by far likelier: what no chance brings, whatever else the data leave
/// open? Not where that was not asked for.
bool carries_most(const Loss& without, const Loss& with);

/// Is there a material remainder: a signal whose mean square is above the floor by more than the rule allows?
bool remainder(const Loss& loss, const Materiality& rule = {});
bool remainder_in(const Loss& loss, Signal signal, const Materiality& rule = {});

}  // namespace emtb
