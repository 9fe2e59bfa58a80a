#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/record/record.h"
#include "model/effect.h"
#include "model/model.h"

namespace emtb {

/// What is there of a bench, as its model and its records say. What neither says (a winding or magnets?) is taken to be
/// there, but for the field of a current drive: there, only the torque constant would show it, and that is shared with
/// inertia and friction.
BenchParts parts_of_bench(const Model& model, std::span<const Record> records);

/// What an effect needs of a bench and does not find there, in words: `the speed comes from an encoder, not from a
/// tachogenerator`. Empty: it finds all.
std::string_view missing_part(const EffectInfo& effect, const BenchParts& there);

/// An effect that a search does not try, and why.
struct Withheld {
  std::size_t effect = 0;
  std::string why;
};

/// The effects that cannot be ones of the bench, and those that the model withholds already: what a person asked for.
/// Those that a model includes are its own matter.
std::vector<Withheld> withheld_effects(const Model& model, std::span<const Record> records);

/// What a person wants to be tried of all that a model knows.
struct Wanted {
  std::vector<std::string> only = {};     ///< ids, each or several with commas between; empty: all
  std::vector<std::string> without = {};  ///< likewise
};

/// Lets a model withhold what is not wanted. What one of `only` needs is wanted, too.
/// @throws ModelError naming the known ids where one is unknown
void withhold_unwanted(Model& model, const Wanted& wanted);

}  // namespace emtb
