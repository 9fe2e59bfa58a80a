#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "session/session.h"
#include "tests/blind/hidden.h"

namespace emtb::blind {

enum class CaseKind { healthy, single, pair, outside };
std::string_view name_of(CaseKind kind) noexcept;
std::optional<CaseKind> kind_named(std::string_view name) noexcept;

/// Something that a case hides, and how much of it.
struct Truth {
  std::string id;
  double size = 0;                        ///< times the typical one
  std::vector<TrueParameter> parameters;  ///< empty where the plant's law is not the library's
  std::vector<std::string> right;         ///< ids that count as right: itself and its exact aliases
};

/// A bench, what is hidden in it, and what was recorded there: all from one seed.
struct Case {
  std::string id;  ///< `single:17`
  CaseKind kind{};
  std::uint64_t seed = 0;
  BenchKind bench_kind{};
  Bench bench;
  std::vector<Truth> truths;
  std::vector<std::string> given;  ///< effects that plant and model have from the start
  std::vector<std::string>
      tolerated;  ///< effects that are there beside the truth: naming them is neither asked nor wrong
  std::vector<std::string> lacking;  ///< of all these, what the library does not have
  std::string nuisance;              ///< what else is unlike the plain bench, for people
  std::vector<Run> train, held_out;
  /// Held-out error of the given model on the same bench with nothing hidden, in units of the true sigma: above 1 where
  /// the noise of what drives the motor (e_a, torque) reaches what is compared.
  double floor = 1;
  double linear_error = 0;  ///< held-out error of the given model, in units of that floor
};

/// Which effects (or outside law) a case is about, without recording anything. Consecutive numbers go through all of
/// them in turn. None for a healthy case, two for a pair.
std::vector<std::string_view> subjects_of(CaseKind kind, std::size_t number);

/// How much is recorded, and how unlike the plain bench it is.
enum class Setting {
  laboratory,  ///< 200 to 250 s in six runs, all nuisances
  brief,       ///< all nuisances, six runs as short as those of an impatient person
  easy         ///< as brief; all channels, K_m = K_b, driver known, white noise: for tests that must not take long
};

/// Makes case `number` of a kind. The hidden effects are sized so that the given model's held-out error is 1.2 to 5
/// times the floor for each alone; where the bench that was drawn cannot show an effect at a plausible size, another
/// bench is drawn.
/// @throws ModelError where no bench shows it.
Case make_case(CaseKind kind, std::size_t number, std::uint64_t base_seed, Setting setting = Setting::laboratory);

/// The instruments' sigma: noise and steps.
std::map<Signal, double> true_sigma(const Bench& bench);

/// Mean squares of a model as it stands on a case's held-out runs, in units of the true sigma.
std::map<Signal, double> true_mean_squares(const Case& c, const Model& model);

}  // namespace emtb::blind
