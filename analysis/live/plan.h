#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "hal/input_device.h"
#include "hal/signal.h"
#include "model/model.h"
#include "model/structure.h"

namespace emtb {

/// What is compared with what, and which parameters move.
struct LivePlan {
  struct Output {
    Signal signal{};
    bool slow = false;
    double lsb = 0;
    double declared = 0;     ///< [SI] sigma; 0: not declared
    std::size_t offset = 0;  ///< of a slow output: its place among the unknowns
  };

  ModelStructure structure;
  std::vector<std::vector<std::size_t>> moved;  ///< by each free parameter, places in the structure
  std::vector<Output> outputs;
  double period = 1e-3;        ///< [s] of the ticks
  double longest_step = 1e-2;  ///< [s] of the simulation
  std::size_t block = 10;      ///< ticks whose mean counts as one
  std::size_t second = 1000;   ///< ticks whose residuals are told apart from others as independent
  std::size_t seconds = 61;    ///< of them in a chapter
  double longest_gap = 0.01;   ///< [s] between two ticks; beyond it the states are found anew
  double settling = 1;         ///< [s] after which a wrong initial state is forgotten
  double longest_window = 1;   ///< [s] of a slow meter, and how late it may come

  std::vector<Signal> direct;  ///< what an unknown adds to the readings of a signal, and to nothing else
  std::size_t offsets = 0;     ///< slow meters, each with an unknown

  /// Unknowns: the free parameters, what is direct, then what each slow meter's rounding does to a value that stands
  /// still.
  std::size_t unknowns() const { return moved.size() + direct.size() + offsets; }
};

/// Times without a tick, in periods: beyond that what happened meanwhile is not known. By hand: a missed deadline or
/// four are no gap.
inline constexpr double gap_ticks = 5.5;

/// @param model without effects that repeat with the angle. @param rate [Hz] of the ticks
/// @param chapter [s] of history that is kept at least
/// @throws ModelError where the bench lacks the model's input, or measures nothing to compare with
LivePlan live_plan(const Model& model, const FreeParameters& free, std::span<const Channel> channels, double rate,
                   double chapter);

/// The model without what repeats with the angle: at which angle a run starts is not known.
/// @param left_out takes the ids of these effects
Model without_periodic(Model model, std::vector<std::string>& left_out);

/// What measures a signal; null: nothing.
const Channel* find_channel(std::span<const Channel> channels, Signal signal);

}  // namespace emtb
