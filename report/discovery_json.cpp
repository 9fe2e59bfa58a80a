#include "report/discovery_json.h"

#include <algorithm>

#include "report/discovery_words.h"
#include "report/result_json.h"

namespace emtb {
namespace {

using json = nlohmann::ordered_json;

const char* how(ChangeOf how) {
  return how == ChangeOf::one_run ? "one_run" : how == ChangeOf::from_here_on ? "from_here_on" : "drift";
}

json law_json(const Law& law) {
  json parameters = json::object();
  for (const Parameter& p : law.parameters) {
    parameters[p.symbol] = {{"value", number_json(p.value)},
                            {"std_error", p.fixed ? json(0) : json(number_json(p.std_error))},
                            {"unit", p.unit}};
  }
  json tied = json::array();
  for (const FormulaText& t : law.tied_with) tied.push_back(t.in_words());
  json one{{"place", name_of(law.text.place)}, {"of", law.text.of}, {"formula", law.text.formula}};
  if (!law.text.rate.empty()) one["memory"] = {{"z", law.text.rate}};
  one["id"] = law.text.id;
  one["parameters"] = parameters;
  one["error"] = {
      {"before", {{"train", number_json(law.train_before)}, {"held_out", number_json(law.held_out_before)}}},
      {"after", {{"train", number_json(law.train_after)}, {"held_out", number_json(law.held_out_after)}}}};
  one["confirmed"] = {{"before", number_json(law.confirm_before)}, {"after", number_json(law.confirm_after)}};
  one["nats"] = number_json(law.nats);
  one["curve"] = {{"at", law.at}, {"value", law.value}, {"std_error", law.value_error}};
  one["resembles"] = law.resembles;
  one["likeness"] = number_json(law.likeness);
  one["tied_with"] = tied;
  one["nearest"] = law.nearest ? json(law.nearest->in_words()) : json(nullptr);
  one["may_be"] = may_be(law.text);
  one["most_uncertain_at"] = law.most_uncertain_at;
  return one;
}

json shares_json(const Shares& s) {
  json of = json::object();
  for (const auto& [name, share] : s.of) {
    of[name] = {{"alone", number_json(share.alone)},
                {"only", number_json(share.only)},
                {"std_error", number_json(share.std_error)}};
  }
  return {{"rms", number_json(s.rms)},
          {"of", of},
          {"together", number_json(s.together)},
          {"ceiling", number_json(s.ceiling)}};
}

json machine_json(const Discovery& d) {
  json out{{"laws", json::array()}, {"changed", json::array()}, {"disturbances", json::array()}};
  if (d.law) out["laws"].push_back(law_json(*d.law));
  for (const Changed& c : d.changed) {
    out["changed"].push_back({{"run", c.run},
                              {"parameter", c.parameter},
                              {"from", number_json(c.from)},
                              {"to", number_json(c.to)},
                              {"std_error", number_json(c.std_error)},
                              {"unit", c.unit},
                              {"how", how(c.how)},
                              {"runs", c.runs},
                              {"nats", number_json(c.nats)},
                              {"tied_with", c.tied_with}});
  }
  for (const Disturbance& x : d.disturbances) {
    out["disturbances"].push_back(
        {{"run", x.run}, {"from_s", x.from_s}, {"to_s", x.to_s}, {"torque", number_json(x.torque)}});
  }
  return out;
}

}  // namespace

json to_json(const Discovery& d) {
  json out = machine_json(d);
  if (d.with_disturbances) {
    out["with_disturbances"] = {{"error",
                                 {{"train", number_json(d.with_disturbances->train)},
                                  {"held_out", number_json(d.with_disturbances->held_out)}}},
                                {"laws", json::array()}};
    if (d.with_disturbances->law) out["with_disturbances"]["laws"].push_back(law_json(*d.with_disturbances->law));
  }
  out["left"] = json::object();
  for (const auto& [signal, rmse] : d.rmse) {
    json of = json::object();
    const Shares& s = signal == Signal::i_a && d.left.voltage_seen ? d.voltage : d.torque;
    for (const auto& [name, share] : s.of) of[name] = number_json(std::max(0.0, share.alone));
    out["left"][std::string(info(signal).name)] = {{"rmse", number_json(rmse)}, {"of", of}};
  }
  out["missing"] = {{"torque", shares_json(d.torque)}, {"voltage", shares_json(d.voltage)}};
  out["error"] = {{"train", number_json(d.train)}, {"held_out", number_json(d.held_out)}};
  out["words"] = shares_in_words(d);
  out["next_experiment"] = next_for_discovery(d).empty() ? json(nullptr) : json(next_for_discovery(d));
  out["worth_a_name"] = d.worth_a_name;
  out["parameters"] = parameters_json(d.law ? d.law->model : d.fitted);
  return out;
}

json to_json(const std::vector<Trend>& trends) {
  json out = json::object();
  for (const Trend& t : trends) {
    json points = json::array();
    for (const TrendPoint& p : t.points) {
      points.push_back({{"session", p.run},
                        {"value", number_json(p.value)},
                        {"std_error", number_json(p.std_error)},
                        {"line", number_json(p.line)},
                        {"line_error", number_json(p.line_error)}});
    }
    out[t.parameter] = {{"unit", t.unit},
                        {"points", points},
                        {"slope", number_json(t.slope)},
                        {"slope_error", number_json(t.slope_error)},
                        {"whole", number_json(t.whole)},
                        {"clear", t.clear}};
  }
  return out;
}

}  // namespace emtb
