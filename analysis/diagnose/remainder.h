#pragma once

#include <span>

#include "analysis/diagnose/finding.h"
#include "analysis/diagnose/loss.h"
#include "analysis/record/dataset.h"
#include "model/model.h"

namespace emtb {

/// Is more left of some signal than noise, and a share of it that matters, whether it comes again or not?
/// @param inputs as below
bool leaves_a_share(const Loss& left, std::span<const Signal> inputs, const Materiality& rule);

/// Is what a model leaves worth a name? It is where a signal is above its floor by more than the floor is uncertain, by
/// more than a fiftieth of how much it varies, and
///  - either by more of how much the signal varies than a disturbance of its own would make, and where the floor is
///    only known to be no lower, by more than the colour of noise could make it,
///  - or it comes again from piece to piece (comes_again.h): then it is a law that the model lacks.
/// Where a floor is only known to be no higher than it is, nothing can be said of what lies below it.
/// @param inputs signals that drive the model as they were read: what is left of them bends nothing
bool worth_a_name(const Dataset& data, const Model& model, const Loss& held_out, std::span<const Signal> inputs,
                  const Materiality& rule = {});

/// Does an effect of the library leave less than a tenth of what is left above the floor, at a value at which it is not
/// what it is called? Then what is left is a law, without a name; less is a mimic of one. What is late by less than a
/// row is none: the logging may be.
/// @param error that is left, in floors
bool is_of_a_refused_law(std::span<const Candidate> candidates, double error);

}  // namespace emtb
