#pragma once

#include <optional>
#include <span>
#include <string>

#include "analysis/diagnose/likelihood.h"
#include "analysis/record/record.h"
#include "model/model.h"

namespace emtb {

/// What the library says to runs of which somebody says that they are not all of the same machine.
struct LibraryRival {
  Model model;  ///< with the effect, fitted to all runs
  std::string id;
  double nats = 0;  ///< by which Q rises
};

/// The effect of the library that makes Q of all runs rise most; none where none does by three nats, with a size that
/// the data tell to three of its standard errors.
/// @param fitted to all of them @param quality of it
std::optional<LibraryRival> best_of_library(std::span<const Record> records, const Model& fitted,
                                            const Quality& quality);

}  // namespace emtb
