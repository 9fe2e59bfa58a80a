#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "analysis/record/record.h"
#include "model/effect.h"
#include "model/model.h"

namespace emtb {

/// How many turns the shaft makes in a run, at most.
double most_turns(std::span<const Record> records);

/// The finest wave of the turn that the rows of any run follow, in a tenth of those in which the shaft turns: from row
/// to row it goes on by half of it. Of a finer one they show any other.
double finest_wave(std::span<const Record> records);

/// The fitted machine, and how far it goes on some records.
FittedMachine machine_of(std::span<const Record> records, const Model& fitted);

/// Why an effect of a fitted model is not named, though it may explain the records: with these values it is not what it
/// is called, as its own file states, or its size rests on a bound beyond which it would go on. `J_2 is 0.012 kg m2,
/// not below 0.011 kg m2, J`. Empty: it may be. Formulas of a user have no range but their bounds.
std::string implausible_value(std::span<const Record> records, const Model& fitted, std::size_t effect);

}  // namespace emtb
