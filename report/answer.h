#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "analysis/diagnose/diagnose.h"

namespace emtb {

/// What was named on the command line, to be named again in the command that comes next.
struct NamedFiles {
  std::string model;
  std::vector<std::string> sessions = {}, held_out = {};
  std::string map = {}, candidates = {};  ///< empty: none
  std::string out = {};                   ///< where the final model was written; empty: nowhere
};

/// ` MODEL SESSION... --held-out SESSION... --map FILE`, as a shell takes it.
std::string as_arguments(const NamedFiles& files);

/// What to type next: adds what was found, runs what tells ties apart, or looks at what has no name.
std::string next_command(const Diagnosis& diagnosis, const NamedFiles& files);

/// `found: the best other effect, bearing_drag, leaves 39.8 noise floors`
std::string how_sure(const Diagnosis& diagnosis);

/// The answer in exactly five lines, what a reader of the terminal sees last: what is missing, how large it is, how
/// sure that is, the errors before and after, and the next command.
std::string answer_text(const Diagnosis& diagnosis, const NamedFiles& files);

/// The candidates as a table, best first, with a legend of at most `width` columns above it.
/// @param shown so many rows at most; 0: all, with the statistics of each
std::string candidates_text(const Diagnosis& diagnosis, std::size_t shown, std::size_t width);

}  // namespace emtb
