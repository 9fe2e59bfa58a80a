#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/signal.h"
#include "model/structure.h"

namespace emtb {

/// What is known of a parameter besides this data, e.g. an ohmmeter reading of R_a.
struct Prior {
  double value = 0;
  double std = 0;
};

/// A parameter as the model file states it.
struct Parameter {
  std::string symbol;  ///< `R_a`, `T_c`
  std::string unit;
  double value = 0;
  double min = 0;
  double max = 0;
  bool fixed = false;
  std::optional<Prior> prior;
  std::optional<double> std_error;  ///< of the last calibration; none where it exceeds the bounds: not determined
  bool pinned = false;  ///< fixed for as long as a diagnosis lasts, because the data cannot tell it (see Pin)
};

/// The values of some parameters, in their order.
std::vector<double> values_of(std::span<const Parameter> parameters);

/// An effect that the model includes.
struct IncludedEffect {
  std::size_t effect = 0;             ///< place in the catalogue
  std::vector<Parameter> parameters;  ///< in the order of its EffectInfo
};

struct EffectInfo;
struct EffectParameter;

/// A term of the equations beside the catalogue's effects.
struct AddedTerm {
  std::string name;
  TermPlace place = TermPlace::torque;
  std::shared_ptr<const Term> term;
  std::vector<Parameter> parameters;
  std::string formula;                     ///< as the user wrote it; empty: no formula
  std::string memory;                      ///< name of what it remembers; empty: nothing
  std::string rate_formula;                ///< of that, as the user wrote it
  std::shared_ptr<const Term> rate;        ///< the same, see PlacedTerm
  std::shared_ptr<const EffectInfo> info;  ///< of a formula: the same as is known of the catalogue's effects

  PlacedTerm placed() const { return {place, term, parameters.size(), rate}; }
};

/// What was done to the model, and what it brought.
struct HistoryEntry {
  std::string action;              ///< `calibrated`, `added coulomb_friction`
  std::optional<double> train;     ///< error on the sessions it was fitted to, in units of the noise floor
  std::optional<double> held_out;  ///< error on sessions it never saw
  std::vector<std::string> sessions;
};

/// What a model file says of the bench beyond its records: no reading tells a motor with magnets from one with a
/// winding.
struct BenchFacts {
  std::optional<bool> field_winding;   ///< `field: winding` or `field: magnets`; absent: it may have one
  std::optional<bool> tachogenerator;  ///< `speed: tachogenerator` or `speed: encoder`; absent: as the records show
};

/// A model file in memory: which physics, with which numbers, and how it came to them.
struct Model {
  std::string name;
  Signal input = Signal::u_ref;
  std::optional<DriverModel> driver;
  std::map<std::string, std::string> tie;  ///< {K_m: K_b}: the first follows the second
  std::vector<Parameter> base;             ///< R_a, K_b, K_m, B, J
  std::vector<IncludedEffect> effects;     ///< in the order of the catalogue
  std::vector<AddedTerm> terms;
  std::vector<AddedTerm> offered;     ///< formulas that a search may add to `terms`; no part of the model file
  std::vector<std::size_t> withheld;  ///< effects that a search may not add; no part of the model file
  BenchFacts bench;
  std::map<Signal, double> noise;  ///< declared sigma
  std::vector<HistoryEntry> history;

  /// The equations; what is measured (measured_voltage, measured_load) is the data's matter and stays false.
  ModelStructure structure() const;

  /// All values in the order of the structure, ties resolved.
  std::vector<double> values() const;

  /// Effects go by number: those of the catalogue, then the formulas on offer.
  std::size_t known_effects() const;
  const EffectInfo& about(std::size_t effect) const;
  /// @throws ModelError naming the known ids.
  std::size_t effect_named(std::string_view id) const;

  bool includes(std::size_t effect) const;
  bool withholds(std::size_t effect) const;

  /// Those of an included effect. @throws ModelError where it is not.
  std::vector<Parameter>& parameters_of(std::size_t effect);
  const std::vector<Parameter>& parameters_of(std::size_t effect) const;

  /// Includes an effect at its null value with the bounds that are known of it, free. No-op where it is included
  /// already. A phase is held where it is the only one: the angle at which a run starts is free, and takes its place.
  void include(std::size_t effect);
  void exclude(std::size_t effect);

  /// `R_a`, or `tacho_lag.tau` for a parameter of an effect, in the order of the structure.
  std::vector<std::string> names() const;

  /// [s] with which the speed follows the voltage, J R_a/(K_b K_m); with a current drive J/B.
  double mechanical_time_constant() const;

  /// What is known of the parameter at a place of the structure; null for a base parameter and for a bare term.
  const EffectParameter* known_of(std::size_t place) const;

  bool periodic() const;  ///< includes an effect that repeats with the angle

  /// The parameter at a place of the structure.
  Parameter& at(std::size_t i);
  const Parameter& at(std::size_t i) const;

 private:
  void hold_first_phase();
};

/// The same machine as it is, not as its instruments read it.
Model without_sensors(Model model);

/// The parameters that a fit may move: a model's parameters less those that are fixed or tied.
class FreeParameters {
 public:
  explicit FreeParameters(const Model& model);

  std::size_t size() const { return free_.size(); }
  std::span<const std::size_t> places() const { return free_; }

  std::vector<double> pick(std::span<const double> all) const;

  /// All values of the structure, with the free ones replaced and ties followed.
  std::vector<double> spread(std::span<const double> free) const;

  /// Which free parameter moves the parameter at a place of the structure: its index, or nothing.
  std::optional<std::size_t> mover(std::size_t place) const { return movers_[place]; }

 private:
  std::vector<std::size_t> free_;
  std::vector<std::optional<std::size_t>> movers_;
  std::vector<double> all_;
};

/// A model with other values of its free parameters, and of what is tied to them.
Model with_values(Model model, const FreeParameters& free, std::span<const double> x);

/// For each free parameter, the places that it moves.
inline std::vector<std::vector<std::size_t>> moved_by(const FreeParameters& free) {
  std::vector<std::vector<std::size_t>> moved(free.size());
  for (std::size_t place = 0; place < free.spread(free.pick({})).size(); ++place) {
    if (const auto mover = free.mover(place)) moved[*mover].push_back(place);
  }
  return moved;
}

}  // namespace emtb
