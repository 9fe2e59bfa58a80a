#include "export/equations.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "hal/error.h"
#include "model/catalogue.h"

namespace emtb {
namespace {

constexpr std::array gain_error{Statement{"gain", "gain*(1 + $k)"}, Statement{"offset", "offset + $e_0*positive(u)"}};
constexpr std::array slew_limits{Statement{"rise", "$rise"}, Statement{"fall", "$fall"}};
constexpr std::array dead_zone{Statement{"u", "beyond(u, $u_d)"}};
constexpr std::array saturation_limit{Statement{"e_min", "e_min - positive(-e_min)*($e_max + e_min)"},
                                      Statement{"e_max", "$e_max"}};
constexpr std::array output_resistance{Statement{"output_resistance", "output_resistance + $R_o"}};
constexpr std::array lag{Statement{"lag", "lag + $tau"}};
constexpr std::array one_quadrant{Statement{"one_quadrant", "1"}};
constexpr std::array lets_go{Statement{"lets_go", "1"}};
constexpr std::array inductance{Statement{"inductance", "inductance + $L_a"}};
constexpr std::array brush_drop{Statement{"contact_drop", "contact_drop + $V_b"},
                                Statement{"contact_knee", "contact_knee + $i_lin"}};
constexpr std::array reaction{Statement{"reaction", "$k_i"}, Statement{"reaction_knee", "$i_k"}};
constexpr std::array field_heating{Statement{"flux", "flux*(1 - $drop*(1 - exp(-t/$tau)))"}};
constexpr std::array coulomb{Statement{"dry_friction", "dry_friction + $T_c"}};
constexpr std::array stribeck{Statement{"dry_friction", "dry_friction + $T_s*exp(-(omega/$omega_s)*(omega/$omega_s))"}};
constexpr std::array asymmetric{
    Statement{"braking_torque", "braking_torque + ($T_d + $B_d*abs(omega))*abs(sign(omega))"}};
constexpr std::array windage{Statement{"braking_torque", "braking_torque + $c_w*omega*abs(omega)"}};
constexpr std::array bearing_drag{
    Statement{"braking_torque", "braking_torque + $c_b*omega*pow(omega*omega + 1.0e-6, -1.0/6.0)"}};
constexpr std::array warmup{Statement{"viscous", "viscous*(1 - $drop*(1 - exp(-t/$tau)))"},
                            Statement{"dry_friction", "dry_friction*(1 - $drop*(1 - exp(-t/$tau)))"}};
constexpr std::array cogging{
    Statement{"braking_torque", "braking_torque + $T_cog*mean_sine($N*theta + $phase, $N*omega*h)"}};
constexpr std::array load_torque{Statement{"load_torque", "load_torque + $T_L"}};
constexpr std::array dry_brake{Statement{"brake", "brake + $T_b"}};
constexpr std::array eccentric{Statement{"load_torque", "load_torque + $T_e*mean_sine(theta + $phase, omega*h)"}};
constexpr std::array spring{Statement{"load_torque", "load_torque + $T_0 + $k*theta"}};
constexpr std::array eddy_brake{
    Statement{"load_torque", "load_torque + 2*$T_b*(omega/$omega_b)/(1 + (omega/$omega_b)*(omega/$omega_b))"}};

constexpr std::array<WrittenEffect, 24> written{{{"driver_gain_error", gain_error},
                                                 {"driver_slew", slew_limits},
                                                 {"driver_dead_zone", dead_zone},
                                                 {"driver_saturation", saturation_limit},
                                                 {"driver_output_resistance", output_resistance},
                                                 {"driver_lag", lag},
                                                 {"one_quadrant_driver", one_quadrant},
                                                 {"coasting_driver", lets_go},
                                                 {"armature_inductance", inductance},
                                                 {"brush_drop", brush_drop},
                                                 {"armature_reaction", reaction},
                                                 {"field_heating", field_heating},
                                                 {"coulomb_friction", coulomb},
                                                 {"stribeck_friction", stribeck},
                                                 {"asymmetric_friction", asymmetric},
                                                 {"windage", windage},
                                                 {"bearing_drag", bearing_drag},
                                                 {"friction_warmup", warmup},
                                                 {"cogging", cogging},
                                                 {"load_torque", load_torque},
                                                 {"dry_brake", dry_brake},
                                                 {"eccentric_load", eccentric},
                                                 {"spring_load", spring},
                                                 {"eddy_brake", eddy_brake}}};

/// `$T_c` of an effect becomes `$coulomb_friction_T_c`.
std::string with_prefix(std::string_view text, const std::string& prefix) {
  std::string out;
  for (const char c : text) {
    out += c;
    if (c == '$') out += prefix;
  }
  return out;
}

void refuse_unwritten(const Model& model) {
  std::string names;
  for (const IncludedEffect& e : model.effects) {
    const EffectInfo& info = effect_catalogue()[e.effect];
    const bool known = std::ranges::find(written, info.id, &WrittenEffect::id) != written.end();
    if (info.stage != Stage::sensors && !known) names += (names.empty() ? "" : ", ") + std::string(info.id);
  }
  for (const AddedTerm& term : model.terms) names += (names.empty() ? "" : ", ") + term.name + " (a formula)";
  if (names.empty()) return;
  throw ModelError("model `" + model.name + "`: no simple equation can be exported for " + names +
                   ". Take it out of the model, or linearise about a speed: --linear --at RAD_S");
}

void add_driver(ExportedEquations& out, const Model& model) {
  if (model.input != Signal::u_ref) return;
  const DriverModel d = model.driver.value_or(DriverModel{});
  out.parameters.insert(out.parameters.end(), {{"driver_gain", "V/V", "gain of the driver", d.gain},
                                               {"driver_rise", "V/s", "it rises no faster", d.rise},
                                               {"driver_fall", "V/s", "it falls no faster", d.fall},
                                               {"driver_min", "V", "lowest output", d.min},
                                               {"driver_max", "V", "highest output", d.max}});
}

/// A model's name, which others may have given, as text of a comment that it does not end.
std::string in_a_comment(std::string name) {
  for (std::size_t at = name.find("*/"); at != std::string::npos; at = name.find("*/")) name.insert(at + 1, " ");
  return name;
}

}  // namespace

std::span<const WrittenEffect> written_effects() noexcept { return written; }

bool blocks_circuit(std::string_view term) noexcept { return term == "one_quadrant" || term == "lets_go"; }

ExportedEquations equations_of(const Model& model) {
  refuse_unwritten(model);
  ExportedEquations out{.model = in_a_comment(model.name),
                        .input = model.input,
                        .both_ways = model.driver.value_or(DriverModel{}).min < 0};
  const std::vector<double> values = model.values();
  for (std::size_t i = 0; i < base_parameters.size(); ++i) {
    const BaseParameter& p = base_parameters[i];
    out.parameters.push_back({std::string(p.symbol), std::string(p.unit), std::string(p.name), values[i],
                              model.at(i).std_error.value_or(0)});
  }
  add_driver(out, model);
  std::size_t place = base_parameters.size();
  for (const IncludedEffect& e : model.effects) {
    const EffectInfo& info = effect_catalogue()[e.effect];
    if (info.stage == Stage::sensors) {
      out.left_out.emplace_back(info.id);
      place += info.parameter_count;
      continue;
    }
    out.included.emplace_back(info.id);
    const std::string prefix = std::string(info.id) + "_";
    for (std::size_t i = 0; i < info.parameter_count; ++i, ++place) {
      const EffectParameter& p = info.parameters()[i];
      out.parameters.push_back({prefix + std::string(p.symbol), std::string(p.unit), std::string(info.name),
                                values[place], e.parameters[i].std_error.value_or(0)});
    }
    for (const Statement& s : std::ranges::find(written, info.id, &WrittenEffect::id)->statements) {
      auto& part = info.stage == Stage::driver && !blocks_circuit(s.term) ? out.driver : out.machine;
      part.push_back({std::string(s.term), with_prefix(s.value, prefix)});
    }
  }
  return out;
}

}  // namespace emtb
