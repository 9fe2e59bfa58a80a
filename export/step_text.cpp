#include "export/step_text.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <set>

namespace emtb {
namespace {

using List = std::vector<ResolvedStatement>;

void append(List& to, const List& more) { to.insert(to.end(), more.begin(), more.end()); }

/// The reference through the driver: `e_start` and `e_end` of a ramp that has the right mean and end.
List driver_of(const ExportedEquations& x) {
  List list{{"u", "u_ref"},           {"gain", "$driver_gain"}, {"offset", "0"},          {"e_min", "$driver_min"},
            {"e_max", "$driver_max"}, {"rise", "$driver_rise"}, {"fall", "$driver_fall"}, {"lag", "0"}};
  append(list, x.driver);
  append(list, {{"target", "clamp(gain*u + offset, e_min, e_max)"},
                {"moved_mean", "slew_mean(@e_slewed, target, rise, fall, h)"},
                {"moved", "slew_end(@e_slewed, target, rise, fall, h)"},
                {"e_end", "lag_end(@e_driver, 2*moved_mean - moved, moved, lag, h)"},
                {"e_mean", "moved_mean - lag*(e_end - @e_driver)/h"},
                {"e_start", "2*e_mean - e_end"},
                {"@e_slewed", "moved"},
                {"@e_driver", "e_end"}});
  return list;
}

/// The armature circuit over the step, with `conducts` 1 or 0.
List circuit_of(const ExportedEquations& x) {
  // Which way a driver that takes no current back lets one flow.
  const std::string way = x.both_ways ? "positive(source) - positive(-source)" : "1";
  const std::string asked =
      x.input == Signal::u_ref ? "positive(u) + positive(-u)" : "positive(source) + positive(-source)";
  const std::string drives = x.input == Signal::i_a ? "0"
                             : !may_block(x)
                                 ? "1"
                                 : "(1 - lets_go*(1 - asked))"
                                   "*(1 - one_quadrant*(1 - positive(way*driving))*(1 - positive(way*stopping)))";
  // The flux that the armature's own field leaves, for the mean current of the step.
  const std::string mean =
      x.input == Signal::i_a ? "i_a_ref" : "reacting(pushed - taken, taken, @i_a, reaction, reaction_knee)";
  return {{"ohm", "resistance + output_resistance"},
          {"tau", "inductance/ohm"},
          {"left", "carried(h, tau)"},
          {"part", "tau/h*(1 - left)"},
          {"late", "tau/h*(1 - part)"},
          {"pushed", "((0.5 + late - part)*(e_start - bias) + (0.5 - late)*(e_end - bias))/ohm + part*@i_a"},
          {"taken", "(1 - part)*$K_b*flux*omega/ohm"},
          {"i_mean", mean},
          {"full", "$K_b*flux"},
          {"flux", "flux*(1 - reaction*i_mean*i_mean/(reaction_knee*reaction_knee + i_mean*i_mean))"},
          {"k_b", "$K_b*flux"},
          {"k_m", "$K_m*flux"},
          {"holding", "left/(1 - left)*ohm"},
          {"source", "0.5*(e_start + e_end)"},
          {"way", way},
          {"asked", asked},
          {"driving", "source - bias - k_b*omega"},
          {"stopping", "driving + holding*@i_a"},
          {"conducts", drives},
          {"drop", "conducts*drop_for(stopping, ohm + holding, contact_drop, contact_knee)"},
          {"v_start", "e_start - drop - bias - k_b*@omega"},
          {"v_end", "e_end - drop - bias"},
          {"mean_start", "conducts*(0.5 + late - part)/ohm"},
          {"mean_end", "conducts*(0.5 - late)/ohm"},
          {"mean_i", "conducts*part"},
          {"end_start", "conducts*(part - left)/ohm"},
          {"end_end", "conducts*(1 - part)/ohm"},
          {"end_i", "conducts*left"}};
}

List shaft_of(const ExportedEquations& x) {
  const std::string current = x.input == Signal::i_a ? "i_a_ref" : "mean_start*v_start + mean_end*v_end + mean_i*@i_a";
  return {{"damping", "0.5*(viscous + k_m*k_b*(mean_start + mean_end))"},
          {"behind", "k_m*(mean_start + mean_end)*damping*h/(6*inertia)"},
          {"fitted", "inertia/h + damping*damping*h/(3*inertia)"},
          {"pull", "k_m*(" + current + ") + behind*(e_end - e_start) - braking_torque - load_torque - load"},
          {"omega_end",
           "beyond((fitted - 0.5*viscous)*@omega + pull, dry_friction + brake)"
           "/(fitted + 0.5*viscous + k_m*k_b*mean_end)"},
          {"i_end", x.input == Signal::i_a
                        ? "i_a_ref"
                        : "positive(tau)*(end_start*v_start + end_end*(v_end - k_b*omega_end) + end_i*@i_a)"
                          " + (1 - positive(tau))*reacting(end_end*(v_end - full*omega_end), end_end*full*omega_end,"
                          " @i_a, reaction, reaction_knee)"}};
}

/// The local names that a text reads.
std::set<std::string> reads(const std::string& text) {
  std::set<std::string> names;
  const auto letter = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
  for (std::size_t at = 0; at < text.size();) {
    std::size_t end = at;
    while (end < text.size() && letter(text[end])) ++end;
    const bool digit = std::isdigit(static_cast<unsigned char>(text[at])) != 0;
    const bool local = at == 0 || (text[at - 1] != '$' && text[at - 1] != '@');
    if (end > at && !digit && local) names.insert(text.substr(at, end - at));
    at = std::max(end, at + 1);
  }
  return names;
}

/// Without the locals that no later statement reads: compilers warn of them.
List without_unread(const List& list) {
  std::set<std::string> wanted;
  List kept;
  for (auto s = list.rbegin(); s != list.rend(); ++s) {
    if (!s->term.starts_with('@') && !wanted.contains(s->term)) continue;
    wanted.erase(s->term);
    wanted.merge(reads(s->value));
    kept.push_back(*s);
  }
  std::ranges::reverse(kept);
  return kept;
}

}  // namespace

bool may_block(const ExportedEquations& x) {
  return std::ranges::any_of(x.machine, [](const ResolvedStatement& s) { return blocks_circuit(s.term); });
}

std::vector<StateText> states_of(const ExportedEquations& x) {
  std::vector<StateText> states{{"t", "s", "since the start"},    {"omega", "rad/s", "speed"},
                                {"theta", "rad", "angle"},        {"i_a", "A", "armature current"},
                                {"e_a", "V", "terminal voltage"}, {"omega_before", "rad/s", "a step ago"},
                                {"i_a_before", "A", "a step ago"}};
  if (x.input == Signal::u_ref) {
    states.push_back({"e_slewed", "V", "driver, before its lag"});
    states.push_back({"e_driver", "V", "driver, before its output resistance"});
  }
  return states;
}

std::string input_name(Signal input) {
  return input == Signal::u_ref ? "u_ref" : input == Signal::e_a ? "e_a" : "i_a_ref";
}

std::string input_unit(Signal input) { return input == Signal::i_a ? "A" : "V"; }

StepText step_of(const ExportedEquations& x, const std::string& input) {
  // Effects see the middle of the step, extrapolated from the last one.
  List list{{"omega", "@omega + 0.5*(@omega - @omega_before)"},
            {"i_a", "@i_a + 0.5*(@i_a - @i_a_before)"},
            {"theta", "@theta + 0.5*h*@omega"},
            {"t", "@t + 0.5*h"},
            {"resistance", "$R_a"},
            {"output_resistance", "0"},
            {"inductance", "0"},
            {"contact_drop", "0"},
            {"contact_knee", "0"},
            {"one_quadrant", "0"},
            {"lets_go", "0"},
            {"flux", "1"},
            {"reaction", "0"},
            {"reaction_knee", "1"},
            {"inertia", "$J"},
            {"viscous", "$B"},
            {"bias", "0"},
            {"braking_torque", "0"},
            {"load_torque", "0"},
            {"dry_friction", "0"},
            {"brake", "0"}};
  if (x.input == Signal::u_ref) {
    append(list, driver_of(x));
  } else {
    const std::string e = x.input == Signal::e_a ? input : "0";
    append(list, {{"e_start", e}, {"e_end", e}});
  }
  append(list, x.machine);
  append(list, circuit_of(x));
  append(list, shaft_of(x));
  const std::string terminals = x.input == Signal::i_a
                                    ? "resistance*i_end + k_b*omega_end"
                                    : "conducts*(e_end - output_resistance*i_end) + (1 - conducts)*k_b*omega_end";
  append(list, {{"@theta", "@theta + 0.5*h*(@omega + omega_end)"},
                {"@omega_before", "@omega"},
                {"@i_a_before", "@i_a"},
                {"@omega", "omega_end"},
                {"@i_a", "i_end"},
                {"@e_a", terminals},
                {"@t", "@t + h"}});
  StepText step{without_unread(list), {}};
  for (const ResolvedStatement& s : step.assignments) {
    const bool known = s.term.starts_with("@") || std::ranges::find(step.locals, s.term) != step.locals.end();
    if (!known) step.locals.push_back(s.term);
  }
  return step;
}

std::string spelt(const std::string& text, const std::string& parameters, const std::string& states) {
  std::string out;
  for (const char c : text) {
    if (c == '$') {
      out += parameters;
    } else if (c == '@') {
      out += states;
    } else {
      out += c;
    }
  }
  return out;
}

std::string exact(double value) {
  char text[40];
  const auto [end, error] = std::to_chars(text, text + sizeof text, value);
  std::string out(text, end);
  if (out.find_first_of(".en") == std::string::npos) out += ".0";  // a whole number of C divides as one
  return out;
}

std::string renamed(std::string text, const std::string& from, const std::string& to) {
  const std::string call = from + "(";
  for (std::size_t at = text.find(call); at != std::string::npos; at = text.find(call, at + to.size())) {
    const auto before = at > 0 ? static_cast<unsigned char>(text[at - 1]) : ' ';
    if (std::isalnum(before) == 0 && before != '_') text.replace(at, from.size(), to);
  }
  return text;
}

}  // namespace emtb
