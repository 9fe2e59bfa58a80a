#include <cctype>
#include <sstream>

#include "emtb/version.h"
#include "export/export_text.h"
#include "export/step_text.h"

namespace emtb {
namespace {

/// A name of Modelica's own kind for a model: letters, digits and _.
std::string identifier(const std::string& text) {
  std::string out;
  for (const char c : text) out += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return out.empty() || std::isdigit(static_cast<unsigned char>(out[0])) != 0 ? "M" + out : out;
}

std::string spelt_in_modelica(const std::string& text) { return renamed(spelt(text, "p_", ""), "pow", "power"); }

}  // namespace

std::string modelica_model(const ExportedEquations& x) {
  if (may_block(x)) {
    throw ModelError("model `" + x.model +
                     "`: a driver that lets no current flow at times is not written in Modelica. Take another format");
  }
  const std::string input = input_name(x.input);
  std::ostringstream out;
  out << "// The motor model `" << x.model << "`, written by emtb " << version << ". SI units.\n"
      << "// Not compiled here: emtb has no Modelica compiler to try it with.\n"
      << "// Dry friction is smoothed over 0.01 rad/s; a driver's limits on slopes act within 1 ms.\n";
  for (const std::string& id : x.included) out << "// with " << id << "\n";
  for (const std::string& id : x.left_out) out << "// without " << id << ": it is an instrument's\n";
  out << "model " << identifier(x.model) << "\n";
  for (const ExportedParameter& p : x.parameters) {
    out << "  parameter Real p_" << p.name << " = " << exact(p.value) << " \"[" << p.unit << "] " << p.about;
    if (p.std_error > 0) out << ", +- " << exact(p.std_error);
    out << "\";\n";
  }
  out << "  input Real " << input << "; input Real load;\n"
      << "  output Real omega(start = 0, fixed = true); output Real theta(start = 0, fixed = true);\n"
      << "  output Real i_a;" << (x.input == Signal::e_a ? "" : " output Real e_a;") << "\nprotected\n"
      << "  Real e(start = 0), e_slewed(start = 0), resistance, output_resistance, inductance, contact_drop, "
         "contact_knee;\n"
      << "  Real flux, reaction, reaction_knee, inertia, viscous, braking_torque, load_torque, "
         "dry_friction, brake, bias, t;\n"
      << "  Real u, gain, offset, e_min, e_max, rise, fall, lag;\n"
      << "  function positive\n    input Real x; output Real y;\n  algorithm\n    y := if x > 0 then 1 else 0;\n"
      << "  end positive;\n  function beyond\n    input Real x; input Real limit; output Real y;\n  algorithm\n"
      << "    y := if x > limit then x - limit elseif x < -limit then x + limit else 0;\n  end beyond;\n"
      << "  function power\n    input Real x; input Real n; output Real y;\n  algorithm\n    y := x^n;\n  end power;\n"
      << "  function mean_sine\n    input Real x; input Real width; output Real y;\n  algorithm\n    y := sin(x);\n"
      << "  end mean_sine;\n  constant Real h = 0 \"there are no steps\";\nalgorithm\n  t := time;\n  resistance := "
         "p_R_a;\n  output_resistance := 0;\n  inductance := 0;\n"
      << "  contact_drop := 0;\n  contact_knee := 1;\n  flux := 1;\n  reaction := 0;\n  "
         "reaction_knee := 1;\n  inertia := p_J;\n"
      << "  viscous := p_B;\n  braking_torque := 0;\n  load_torque := 0;\n  dry_friction := 0;\n  brake := 0;\n  bias "
         ":= 0;\n";
  const bool driven = x.input == Signal::u_ref;
  out << "  u := " << input << ";\n  gain := " << (driven ? "p_driver_gain" : "1")
      << ";\n  offset := 0;\n  e_min := " << (driven ? "p_driver_min" : "-1e12")
      << ";\n  e_max := " << (driven ? "p_driver_max" : "1e12")
      << ";\n  rise := " << (driven ? "p_driver_rise" : "1e12")
      << ";\n  fall := " << (driven ? "p_driver_fall" : "1e12") << ";\n  lag := 0;\n";
  for (const auto* part : {&x.driver, &x.machine}) {
    for (const ResolvedStatement& s : *part) out << "  " << s.term << " := " << spelt_in_modelica(s.value) << ";\n";
  }
  out << "  flux := flux*(1 - reaction*i_a^2/(reaction_knee^2 + i_a^2));\nequation\n";
  if (driven) {
    out << "  der(e_slewed) = max(-fall, min(rise, (max(e_min, min(e_max, gain*u + offset)) - e_slewed)/1e-3));\n"
        << "  if lag > 0 then lag*der(e) = e_slewed - e; else e = e_slewed; end if;\n";
  } else {
    out << "  e_slewed = 0;\n  e = " << (x.input == Signal::e_a ? "e_a" : "resistance*i_a + p_K_b*flux*omega") << ";\n";
  }
  if (x.input == Signal::i_a) {
    out << "  i_a = i_a_ref;\n  e_a = e;\n";
  } else {
    out << "  if inductance > 0 then\n    inductance*der(i_a) = e - bias - (resistance + output_resistance)*i_a - "
           "p_K_b*flux*omega - "
           "contact_drop*tanh(i_a/contact_knee);\n  else\n    0 = e - bias - (resistance + output_resistance)*i_a - "
           "p_K_b*flux*omega - contact_drop*tanh(i_a/contact_knee);\n  end if;\n";
    if (driven) out << "  e_a = e - output_resistance*i_a;\n";
  }
  out << "  inertia*der(omega) = p_K_m*flux*i_a - viscous*omega - braking_torque - load_torque - load\n"
      << "    - (dry_friction + brake)*tanh(omega/0.01);\n  der(theta) = omega;\nend " << identifier(x.model) << ";\n";
  return out.str();
}

}  // namespace emtb
