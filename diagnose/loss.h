#pragma once

#include <map>
#include <span>
#include <vector>

#include "estimate/record.h"
#include "estimate/residuals.h"
#include "hal/signal.h"

namespace emtb {

/// How far a model is from data, signal by signal and block by block: enough to say whether one model is better than another,
/// and how sure that is.
class Loss {
 public:
  /// Sums squares over blocks of one second. A model's residuals are correlated over a fraction of that.
  void add(std::span<const Record> records, std::span<const Residuals> residuals, std::size_t first_record = 0);

  std::map<Signal, double> mean_squares() const;  ///< (RMSE/sigma)^2 of each signal; 1 = noise floor
  double error() const;                           ///< sqrt(mean over signals)

  /// Standard error of the mean square of a signal.
  double standard_error(Signal signal) const;

  /// Mean square of `worse` less that of `better` on the same readings, and its standard error from paired blocks.
  struct Difference {
    double gain = 0;
    double standard_error = 0;
  };
  static std::map<Signal, Difference> difference(const Loss& worse, const Loss& better);

 private:
  struct Block {
    double squares = 0;
    double count = 0;
  };
  using Blocks = std::map<std::pair<std::size_t, long>, Block>;  ///< by record and second
  std::map<Signal, Blocks> signals_;
};

/// What counts as a difference. Every wrong model is coloured and "significant" at 10^5 readings: materiality does the work.
struct Materiality {
  double share = 0.10;    ///< of the excess mean square (RMSE^2/sigma^2 - 1) that must go
  double least = 0.02;    ///< of the mean square itself
  double errors = 3;      ///< block standard errors
  double remainder = 0.25;  ///< excess mean square that is called a remainder: 12 % above the floor
};

/// Does going from `without` to `with` remove something material from some signal, and make the whole no worse?
bool material(const Loss& without, const Loss& with, const Materiality& rule = {});

/// Is `other` as good as `best`: in every signal within 2 block standard errors, or not materially worse?
bool tied(const Loss& best, const Loss& other, const Materiality& rule = {});

/// Is there a material remainder: a signal whose mean square is above the floor by more than the rule allows?
bool remainder(const Loss& loss, const Materiality& rule = {});

}  // namespace emtb
