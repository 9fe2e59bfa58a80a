#pragma once

#include <span>
#include <string>
#include <vector>

#include "analysis/fit/calibrate.h"
#include "analysis/fit/gauge.h"
#include "model/model.h"

namespace emtb {

/// What data cannot tell, in words, and what would tell it: alike in the terminal, in JSON and on a page.

/// `R_a is held at 5 ohm: without a measured current these runs tell J R_a and T_c R_a only. To tell it, measure i_a;
/// or give R_a what is known of it (fixed: true, or prior: {value, std}).`
enum class Names { as_written, on_a_page };  ///< `R_a` or `R_{a}`
std::string in_words(const Pin& pin, Names names = Names::as_written);

/// What was recorded of what would separate parameters.
struct Recorded {
  bool current = false, torque = false;
};
Recorded recorded_by(std::span<const Record> records);

/// What would determine these combinations: `fix R_a, or measure i_a`.
std::string advice_on(std::span<const Undetermined> undetermined, const Model& model, const Recorded& recorded);

/// `These data do not determine +0.71 R_a -0.71 J (relative changes): anything fits as well. fix R_a, or measure i_a`
std::string in_words(const Undetermined& undetermined);

/// Does the data tell a fitted parameter? Not where it has no standard error, nor where that is as large as ten times
/// the value, or so small that it is no error at all: both say that the fit stands where the parameter does nothing.
bool is_determined(const Parameter& parameter);

/// `0.0012`, `not determined`, or `-` where none is expected.
/// @param free whether the fit could move it
std::string error_in_words(const Parameter& parameter, bool free);

}  // namespace emtb
