#include "report/discovery_words.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "hal/unit.h"
#include "report/figures_of_diagnosis.h"
#include "report/text.h"
#include "report/words.h"

namespace emtb {
namespace {

std::string percent(double share) { return pretty(std::round(100 * std::clamp(share, 0.0, 1.0)), 3) + " %"; }

std::string quantity(const std::string& name) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 8> names{
      {{"omega", "the speed"},
       {"i_a", "the current"},
       {"acceleration", "the acceleration"},
       {"theta", "the angle in the turn"},
       {"t", "the time since the start"},
       {"u_ref", "the reference"},
       {"direction", "the direction"},
       {"theta_against_motion", "a friction over the angle in the turn"}}};
  for (const auto& [key, word] : names) {
    if (key == name) return std::string(word);
  }
  const std::string between = " and ";
  const std::size_t at = name.find(between);
  if (at == std::string::npos) return name;
  return quantity(name.substr(0, at)) + " with " + quantity(name.substr(at + between.size()));
}

void add_shares(std::vector<std::string>& lines, const Shares& s, const std::string& what, const std::string& unit) {
  constexpr double worth_a_word = 0.05;
  if (s.of.empty()) return;
  std::vector<std::pair<std::string, Share>> list(s.of.begin(), s.of.end());
  std::ranges::stable_sort(list, [](const auto& a, const auto& b) { return a.second.alone > b.second.alone; });
  std::string text = "Of the missing " + what + ", " + pretty(s.rms, 3) + " " + unit + " rms, on runs left out, ";
  std::size_t told = 0;
  double only = 0;
  for (const auto& [name, share] : list) {
    if (share.alone < worth_a_word || told == 3) break;
    const double half = normal_95 * share.std_error;
    text += std::string(told > 0 ? "; " : "") + quantity(name) + " alone explains " + percent(share.alone - half) +
            " to " + percent(share.alone + half) + ", " + percent(std::max(0.0, share.only)) + " of it nothing else";
    only += std::max(0.0, share.only);
    ++told;
  }
  if (told == 0) {
    lines.push_back(text + "no quantity alone explains more than a twentieth: it is run to run, memory or reading.");
    return;
  }
  const double together = std::max(s.together, list.front().second.alone);  // what one foretells, all of them can
  lines.push_back(text + ". All together explain " + percent(together) + "; " +
                  percent(std::max(0.0, s.ceiling - only)) + " several of them can, and " + percent(1 - s.ceiling) +
                  " none: run to run, memory, reading or noise.");
}

/// `4 % higher`, `a third lower`
std::string by(double from, double to) {
  const double change = to / from - 1;
  return pretty(std::round(1000 * std::abs(change)) / 10, 2) + " % " + (change > 0 ? "higher" : "lower");
}

std::string tied_in_words(const Changed& c) {
  if (c.tied_with.empty()) return "";
  return ". As likely, and then no run differs: " + joined(c.tied_with, " or ");
}

std::string in_words(const Changed& c) {
  const std::string values = pretty(c.to, 4) + " " + c.unit + " against " + pretty(c.from, 4) + " " + c.unit +
                             ", the difference known to +- " + pretty(c.std_error, 2);
  switch (c.how) {
    case ChangeOf::from_here_on:
      return c.parameter + " is " + by(c.from, c.to) + " from " + c.run + " on (" + counted(c.runs.size(), "run") +
             "): " + values + tied_in_words(c);
    case ChangeOf::drift:
      return c.parameter + (c.to > c.from ? " grows" : " falls") + " from run to run, from " + pretty(c.from, 4) +
             " to " + pretty(c.to, 4) + " " + c.unit + " (+- " + pretty(c.std_error, 2) + ") in " +
             counted(c.runs.size(), "run") + tied_in_words(c);
    case ChangeOf::one_run:
      break;
  }
  return c.parameter + " is " + by(c.from, c.to) + " in " + c.run + ": " + values + " in the other runs" +
         tied_in_words(c);
}

bool rests_on_a_bound(const Law& law, const Parameter& p) {
  return std::ranges::find(law.at_bound, law.text.id + "." + p.symbol) != law.at_bound.end();
}

}  // namespace

std::string name_of(TermPlace place) {
  return place == TermPlace::torque ? "torque" : place == TermPlace::voltage ? "voltage" : "factor";
}

std::string unit_over(const std::string& of) {
  return of == "omega" ? "rad/s" : of == "i_a" ? "A" : of == "t" ? "s" : of == "u_ref" ? "V" : "rad";
}

std::vector<std::string> shares_in_words(const Discovery& d) {
  std::vector<std::string> lines;
  add_shares(lines, d.torque, "torque", "N m");
  if (d.left.voltage_seen) add_shares(lines, d.voltage, "voltage", "V");
  return lines;
}

std::string no_law_in_words(const Discovery& d) {
  constexpr double ceiling = 0.2;
  if (!d.worth_a_name) {
    return "no law: what is left is no remainder worth a name: at the noise floor, or under 2 % of how much its signal "
           "varies, or not the same from piece to piece";
  }
  if (d.judged_on_training) return "no law: a single run cannot judge one. Name another with --held-out";
  const double most = std::max(d.torque.ceiling, d.left.voltage_seen ? d.voltage.ceiling : 0.0);
  if (most < ceiling) {
    return "no law: run to run, memory or reading. A smooth function of the measured states explains " + percent(most) +
           " of it on runs left out, under 20 %";
  }
  return "no law: smooth functions of the measured states explain " + percent(most) +
         " of it on runs left out, but no formula of three parameters and no curve is material, determined and "
         "confirmed";
}

std::string may_be(const FormulaText& law) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 22> kinds{
      {{"lagging_voltage", "brushes or cells that charge with the current"},
       {"lagging_torque_of_i_a", "currents in solid iron, which hold the field back"},
       {"lagging", "friction that needs time: a film of oil that builds up, rubber or a belt that creeps"},
       {"warming", "grease or a seal that the motion itself warms"},
       {"giving", "dry friction that gives before it slips: a belt, rubber, gears"},
       {"friction_of_speed_and_current", "friction that the torque itself presses on: gears, a belt, a loaded bearing"},
       {"flux_bent_by_speed", "iron in which the turning itself makes currents"},
       {"flux_heated", "a field that the current weakens by and by"},
       {"friction_over_angle", "a bearing, a seal or a belt that is not alike all around the turn"},
       {"wave_of_angle", "slots, poles, gear teeth or a shaft that is not round"},
       {"wave", "a resonance of what the motor stands on"},
       {"bump", "a resonance, or a critical speed of the shaft"},
       {"decaying", "friction that a film of oil carries away as the speed grows"},
       {"falling_from", "friction that a film of oil carries away as the speed grows"},
       {"dry_and", "friction of a seal or a brush, beside a loss that grows with the speed"},
       {"saturating", "dry friction that sets in gradually: a seal, a belt, rolling that slips"},
       {"hyperbolic", "an eddy-current brake, or another drag that passes a greatest value"},
       {"dead_zone", "something that sets in beyond a value: a part that touches, a diode"},
       {"power", "air, oil or grease that is dragged along"},
       {"flux_bent", "iron that saturates, or the armature's own field"},
       {"flux_of", "a field that warms up"},
       {"fading_torque", "grease that warms up"}}};
  if (!law.of.empty() && law.of.front() == "u_ref")
    return "a driver that does not follow its reference alike everywhere";
  for (const auto& [start, meaning] : kinds) {
    if (law.id.starts_with(start)) return std::string(meaning);
  }
  return "";
}

std::vector<std::string> law_in_words(const Law& law) {
  std::vector<std::string> lines{std::string(law.text.is_curve ? "A curve: " : "A law: ") + name_of(law.text.place) +
                                 " = " + law.text.in_words()};
  for (const Parameter& p : law.parameters) {
    lines.push_back("  " + p.symbol + " = " +
                    (p.fixed       ? pretty(p.value, 4) + with_space(p.unit) + ", held"
                     : p.std_error ? pretty(p.value, *p.std_error, p.unit)
                                   : pretty(p.value, 3) + with_space(p.unit)) +
                    (rests_on_a_bound(law, p) ? ", at its bound" : ""));
  }
  lines.push_back("error (1 = noise floor): training " + pretty(law.train_before, 3) + " -> " +
                  pretty(law.train_after, 3) + ", held-out " + pretty(law.held_out_before, 3) + " -> " +
                  pretty(law.held_out_after, 3) + "; Q rises by " + pretty(law.nats, 3) + " nats");
  lines.push_back(law.confirm_after
                      ? "confirmed on a run that neither choice nor fit saw: " + pretty(*law.confirm_before, 3) +
                            " -> " + pretty(*law.confirm_after, 3)
                      : "not confirmed: name two sessions or more with --held-out, and the shortest confirms");
  if (law.text.is_curve) {
    lines.push_back(law.nearest ? "no short formula follows it: the nearest, " + law.nearest->in_words() + ", leaves " +
                                      pretty(law.nearest_held_out, 3) + " held out"
                                : "no short formula follows it");
  }
  if (const std::string meaning = may_be(law.text); !meaning.empty()) lines.push_back("it may be " + meaning);
  if (!law.resembles.empty()) {
    lines.push_back("like " + law.resembles + ": the cosine of what both do to the readings is " +
                    pretty(law.likeness, 2) + ". emtb add " + law.resembles + " fits that one by itself");
  }
  for (const FormulaText& t : law.tied_with) lines.push_back("tied with " + name_of(t.place) + " = " + t.in_words());
  return lines;
}

std::vector<std::string> machine_in_words(const Discovery& d) {
  std::vector<std::string> lines;
  for (const Changed& c : d.changed) lines.push_back(in_words(c));
  for (const Disturbance& x : d.disturbances) {
    lines.push_back(x.run + ": a torque of " + pretty(x.torque, 3) + " N m from " + pretty(x.from_s, 4) + " to " +
                    pretty(x.to_s, 4) + " s, which the same speed and current do not show elsewhere");
  }
  return lines;
}

std::string with_and_without(const Discovery& d) {
  if (!d.with_disturbances) return "";
  const auto law = [](const std::optional<Law>& one) {
    return one ? "the law " + one->text.in_words() : std::string("no law");
  };
  return "cut there. Error (1 = noise floor) with it: training " + pretty(d.with_disturbances->train, 3) +
         ", held-out " + pretty(d.with_disturbances->held_out, 3) + ", " + law(d.with_disturbances->law) +
         "; without it: training " + pretty(d.train, 3) + ", held-out " + pretty(d.held_out, 3) + ", " + law(d.law);
}

std::string next_for_discovery(const Discovery& d) {
  if (!d.law || d.law->most_uncertain_at.empty()) return "";
  const std::string& of = d.law->text.of.front();
  std::vector<std::string> at;
  for (const double x : d.law->most_uncertain_at) at.push_back(pretty(x, 3));
  return "What would show it best: runs that stay for a while at " + of + " = " + joined(at) + " " + unit_over(of) +
         ", where the curve is least sure" + (d.law->tied_with.empty() ? "" : " or its rivals part");
}

std::string discovery_text(const Discovery& d) {
  std::string text = "What is left after the library:\n";
  for (const std::string& line : shares_in_words(d)) text += line + "\n";
  if (d.law) {
    for (const std::string& line : law_in_words(*d.law)) text += line + "\n";
    text += next_for_discovery(d) + "\n";
  } else {
    text += no_law_in_words(d) + "\n";
  }
  for (const std::string& line : machine_in_words(d)) text += line + "\n";
  if (const std::string both = with_and_without(d); !both.empty()) text += both + "\n";
  return text;
}

std::string in_words(const Trend& t) {
  if (t.points.size() < 3) return "three sessions at least tell a trend";
  return "from one to the next " + pretty(t.slope, 3) + " +- " + pretty(normal_95 * t.slope_error, 2) + " " + t.unit +
         " (95 %)" +
         (t.clear ? ": a trend, " + pretty(100 * t.whole, 2) + " % in all" : ": no trend that is clear of the scatter");
}

}  // namespace emtb
