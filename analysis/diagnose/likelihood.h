#pragma once

#include <map>
#include <span>
#include <vector>

#include "analysis/fit/residuals.h"
#include "analysis/record/record.h"
#include "hal/signal.h"

namespace emtb {

/// What a model leaves of a signal beside the noise of its instrument: an error of the model itself, as a process that
/// remembers (Ornstein-Uhlenbeck): no real machine ends at its instruments. Kennedy and O'Hagan (2001); Reichert and
/// Schuwirth (2012) and Del Giudice et al. (2013) for models that move.
struct Discrepancy {
  double variance = 0;  ///< in units of the floor's
  double time = 0;      ///< [s] over which it remembers
};

/// The spectra of what a model leaves of one signal, run by run, in bins that are even on a logarithmic scale, in units
/// of the noise floor.
class ResidualSpectrum {
 public:
  /// @param autocorrelation of the instrument's noise, from one reading to the next
  explicit ResidualSpectrum(double autocorrelation = 0) : autocorrelation_(autocorrelation) {}

  /// @param interval [s] between readings, as good as even
  void add(std::span<const double> residual, double interval);

  /// Adds what another one holds.
  ResidualSpectrum& operator+=(const ResidualSpectrum& other);

  /// Logarithm of the likelihood after Whittle:  -1/2 sum nu_b (ln S_b + P_b/S_b),  with the instrument's spectrum and
  /// that of the model's error.
  double log_likelihood(const Discrepancy& error) const;

  /// The error with which that is largest; none where the instrument's noise alone says as much.
  Discrepancy fitted() const;

 private:
  struct Bin {
    double cosine = 0;    ///< of the frequency, [rad] from one reading to the next
    double freedom = 0;   ///< degrees of freedom, nu
    double power = 0;     ///< mean of the periodogram, P
    double interval = 0;  ///< [s]
  };
  double expected(const Bin& bin, const Discrepancy& error) const;

  double autocorrelation_;
  std::vector<Bin> bins_;
  double readings_ = 0;
};

/// The spectra of all signals.
using ResidualSpectra = std::map<Signal, ResidualSpectrum>;
void add_spectrum(ResidualSpectra& spectra, const Record& record, const Residuals& residuals);
ResidualSpectra spectra_of(std::span<const Record> records, std::span<const Residuals> residuals);

/// What residuals say of a signal: their mean square, and how many there are.
struct SignalSquares {
  double squares = 0;  ///< sum of their squares, in units of the floor's
  double readings = 0;
  double interval = 0;         ///< [s] between them
  double autocorrelation = 0;  ///< of the instrument's noise, from one reading to the next
};
using Squares = std::map<Signal, SignalSquares>;

void add_squares(Squares& sums, const Record& record, const Residuals& residuals);
Squares squares_of(std::span<const Record> records, std::span<const Residuals> residuals);

/// [s] over which the error of a model remembers, signal by signal.
using Memories = std::map<Signal, double>;
Memories memory_of(const ResidualSpectra& spectra);

/// The longest of all signals.
double longest(const Memories& memory);

/// Logarithm of the likelihood of what a model leaves of a signal. With m the mean square in units of the floor's, n
/// readings, and n_eff = n m/(1 + kappa (m - 1)) of them independent, kappa = 2 tau/interval,
///
///     ln L = -1/2 integral from 1 to m of n_eff d(ln m) = -1/2 (n/kappa) ln(1 + kappa (m - 1)).
///
/// Far above the floor that is -1/2 (duration/(2 tau)) ln m: what is gained beside an error of long memory counts for
/// as many pieces as are independent. At the floor it is -1/2 n (m - 1), each reading for itself.
double log_likelihood(const SignalSquares& left, double memory);

/// What is known of a model that was fitted to training runs and tried on others.
struct Quality {
  Squares training, held_out;
  Memories memory;  ///< of its error in the training runs
  std::size_t free_parameters = 0;

  /// Q in nats:  ln L of the training runs - 1/2 ln n_eff for each free parameter + ln L of the runs held out.
  /// @param memory of the error: of models that are compared the same
  double nats(const Memories& memory) const;
};

/// By how much Q rises from one model to another, in nats. The error that the other leaves says how many of the
/// readings are independent: what the first one lacks may last for as long as a run.
double gain(const Quality& without, const Quality& with);

/// [nats] What five standard errors gain.
inline constexpr double by_far_likelier = 0.5 * 5 * 5;

}  // namespace emtb
