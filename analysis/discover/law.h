#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analysis/diagnose/fitted_trials.h"
#include "analysis/discover/grammar.h"
#include "analysis/discover/missing_torque.h"
#include "analysis/discover/shares.h"

namespace emtb {

/// A law that no library holds, fitted in simulation.
struct Law {
  FormulaText text;                                                                   ///< with the fitted values
  std::vector<Parameter> parameters;                                                  ///< with standard errors
  std::vector<std::string> at_bound;                                                  ///< names of those at a bound
  double train_before = 0, train_after = 0, held_out_before = 0, held_out_after = 0;  ///< in noise floors, on all runs
  std::optional<double> confirm_before, confirm_after;  ///< the same, on runs that neither choice nor fit saw
  double nats = 0;                                      ///< by which Q rises
  std::vector<double> at, value;          ///< the curve over the first quantity: torque, voltage or factor
  std::vector<double> value_error;        ///< of the curve, by the standard errors of the parameters
  std::vector<double> most_uncertain_at;  ///< three places at most of the first quantity, where that or the distance
                                          ///< of tied formulas, a straight line aside, is largest
  std::string resembles;                  ///< id of the library's effect that does most alike; empty: none does
  double likeness = 0;                    ///< cosine of what both do to the readings
  std::vector<FormulaText> tied_with;     ///< formulas that do as well
  std::optional<FormulaText> nearest;     ///< of a curve: the short formula that does best, and leaves more
  double nearest_held_out = 0;            ///< in noise floors, as held_out_after
  Model model;                            ///< the fitted model with the law
};

/// Mean squares of a model's residuals on all runs held out, those that confirm among them, as a diagnosis counts.
std::map<Signal, double> squares_on_held_out(const Dataset& data, std::span<const Record> confirm, const Model& model);

/// Searches a law for what a fitted model leaves: a short formula, or where none follows what is left as far as the
/// instruments see it, a curve, where that raises Q by 3 nats and removes a material part of what the formula leaves.
/// @param base the model fitted to data.train, as trials judge it @param confirm runs that nothing has seen; may be
/// empty
/// @return none where no formula is material by the criterion of the library, determined, and confirmed
std::optional<Law> find_law(const Dataset& data, const Trial& base, const Model& given, const Criterion& criterion,
                            std::span<const Record> confirm, const WhatIsLeft& left, const Shares& torque,
                            const Shares& voltage, const ReadFormula& read);

}  // namespace emtb
