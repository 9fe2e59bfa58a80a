#pragma once

#include <span>

#include "analysis/record/record.h"
#include "model/model.h"

namespace emtb {

/// [V] What a driver is fed with, as far as the bench tells: the limit that the model file states of it, or the largest
/// voltage that any record asks for or shows.
double supply_of(std::span<const Record> records, const Model& model);

/// How well it is known by that, for a parameter that is the supply and has no prior of its own. What such a parameter
/// scales, the records often do not tell: a chopped voltage or a current read at the supply leaves a factor of the
/// whole machine open. Supplies sag, and few runs ask for all of one.
Prior known_of_supply(std::span<const Record> records, const Model& model);

}  // namespace emtb
