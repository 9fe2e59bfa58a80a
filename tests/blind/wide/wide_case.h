#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tests/blind/case.h"
#include "tests/blind/wide/effects.h"

namespace emtb::blind::wide {

enum class Kind { healthy, single, pair, triple, outside, garbage };
std::string_view name_of(Kind kind) noexcept;
std::optional<Kind> wide_kind_named(std::string_view name) noexcept;

/// What somebody did wrong with one file.
struct Garbage {
  std::string what;          ///< as `emtb check` calls it: `scale`, `sign`, `clipped` ...
  std::string how;           ///< in words
  bool contradicted = true;  ///< another signal, a bound or the data themselves say so
};

/// A bench, what is hidden in it, and what was recorded there.
struct WideCase {
  std::string id;  ///< `single:17`
  Kind kind{};
  std::uint64_t seed = 0;  ///< of the bench that was drawn
  WideBench bench;
  std::vector<Truth> truths;                      ///< their parameters only where the plant obeys the library's laws
  std::vector<std::vector<TrueParameter>> about;  ///< of each truth: about what the library's law would have
  double visible = 0;                             ///< of the hidden things together; 1: just material
  std::vector<std::string> given;                 ///< effects that plant and model have from the start
  std::optional<Garbage> garbage;
  std::vector<Run> train, held_out, secret;
};

/// Case `number` of a kind: the same whatever else is drawn.
/// @throws ModelError where none of many benches shows anything that was drawn for it
WideCase make_wide_case(Kind kind, std::size_t number, std::uint64_t base_seed);

}  // namespace emtb::blind::wide
