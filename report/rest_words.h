#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/diagnose/compare.h"
#include "analysis/record/dataset.h"
#include "model/model.h"

namespace emtb {

/// What is left of the signals, and when they were read, in words: alike in the terminal, in JSON and on a page.

/// `1.4 mrad/s`: with a unit of a thousand or a thousandth where the number would be long without.
std::string with_scaled_unit(double value, const std::string& unit, int figures = 2);

/// `speed wrong by 1.4 mrad/s rms (fit 98.3 %); the instrument explains 0.002; the rest lasts 0.4 s, like a torque of
/// 12 mN m (3.1 % of that applied); 27.8 noise floors`. Multiples of a floor stand behind it, and not where that is
/// only known to be no higher.
std::string in_words(Signal signal, const SignalFit& fit);

/// One sentence for each signal.
std::vector<std::string> in_words(const std::map<Signal, SignalFit>& fits);

/// These, then the same as a table, multiples of the noise floor in it.
/// @param chained RMSE/sigma of each signal with all units in a row; may be empty
std::string signals_text(const std::map<Signal, SignalFit>& fits, const std::map<Signal, double>& chained = {});

/// Are multiples of this floor worth telling? Not where it is only known to be no higher.
bool has_multiples(const NoiseFloor& noise);

/// `each row was read before its reference acted, as recorded` or what else these runs tell of it.
/// @param interval [s] of a sample
std::string in_words(const Timing& timing, double interval, const Model& model);

}  // namespace emtb
