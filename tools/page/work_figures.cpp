#include <cmath>

#include "analysis/diagnose/compare.h"
#include "analysis/diagnose/missing_curve.h"
#include "analysis/diagnose/overlay.h"
#include "analysis/diagnose/where.h"
#include "hal/error.h"
#include "report/result_json.h"
#include "report/symbols.h"
#include "report/text.h"
#include "server/rpc.h"
#include "tools/page/numbers.h"
#include "tools/page/work.h"

namespace emtb::page {
namespace {

/// Values instead of the model's own, for as long as somebody drags.
Model with_values(Model model, const json& values) {
  const std::vector<std::string> names = model.names();
  for (const auto& [name, value] : values.items()) {
    const auto found = std::ranges::find(names, name);
    if (found == names.end()) throw Error("the model has no parameter " + name);
    if (!value.is_number() || !std::isfinite(value.get<double>())) throw Error(name + " needs a number");
    model.at(static_cast<std::size_t>(found - names.begin())).value = value;
  }
  return model;
}

json signal_json(const Overlay& o, const Window& window, bool measured) {
  const std::vector<double> residual = o.residual();
  double squares = 0;
  for (const double r : residual) squares += r * r;
  const Bins bins = bins_of(o.t, window);
  json out{{"unit", info(o.signal).unit},
           {"rmse", number(std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, residual.size()))))},
           {"floors", number(o.floors())},
           {"t", numbers(bins.t)},
           {"simulated", mean(bins, o.simulated)},
           {"residual", {{"mean", mean(bins, residual)}}}};
  if (!bins.single) {
    out["residual"]["min"] = least(bins, residual);
    out["residual"]["max"] = largest(bins, residual);
  } else {
    out["residual"]["min"] = out["residual"]["mean"];
  }
  if (measured && bins.single) out["measured"] = {{"value", least(bins, o.measured)}};
  if (measured && !bins.single) {
    out["measured"] = {{"min", least(bins, o.measured)}, {"max", largest(bins, o.measured)}};
  }
  return out;
}

}  // namespace

json Work::simulate(const json& params) const {
  const rpc::Params checked(params);
  const std::string id = checked.text("run");
  const Record& run = record(id);
  const Model model = with_values(now_.model, params.value("parameters", json::object()));
  const Window window = Window::of(params, run.excitation.t.back());
  const bool measured = checked.flag_or("measured", true);
  json signals = json::object();
  double sum = 0;
  const std::vector<Overlay> all = overlays(run, model);
  for (const Overlay& o : all) {
    json one = signal_json(o, window, measured);
    const auto floor = data_.noise.find(o.signal);
    one["floor"] = floor == data_.noise.end() ? json(nullptr) : number(floor->second.sigma);
    signals[std::string(info(o.signal).name)] = std::move(one);
    sum += o.floors() * o.floors();
  }
  const json error = number(std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, all.size()))));
  const bool judges = held_out(static_cast<std::size_t>(std::stoul(id)));
  return {{"seq", params.value("seq", json())},
          {"run", id},
          {"signals", signals},
          {"error", {{"train", judges ? json(nullptr) : error}, {"held_out", judges ? error : json(nullptr)}}}};
}

json Work::missing() const {
  json curves = json::array(), maps = json::array();
  for (const MissingCurve& c : missing_curves(data_.train, now_.model)) {
    curves.push_back({{"quantity", c.quantity},
                      {"unit", c.unit},
                      {"against", c.against},
                      {"against_unit", c.against_unit},
                      {"x", numbers(c.x)},
                      {"value", numbers(c.value)},
                      {"std_error", numbers(c.std_error)}});
  }
  std::vector<Record> runs = data_.held_out.empty() ? data_.train : data_.held_out;
  for (const ResidualMap& m : residual_maps(runs, now_.model)) {
    const auto floor = data_.noise.find(m.signal);
    maps.push_back({{"signal", info(m.signal).name},
                    {"unit", info(m.signal).unit},
                    {"against", name_of(m.against)},
                    {"against_unit", unit_of(m.against)},
                    {"bins", numbers(m.bins)},
                    {"mean", numbers(m.mean)},
                    {"std_error", numbers(m.std_error)},
                    {"floors", numbers(m.ratio)},
                    {"explained", number(m.explained)},
                    {"floor", floor == data_.noise.end() ? json(nullptr) : number(floor->second.sigma)}});
  }
  return {{"curves", curves}, {"maps", maps}};
}

json Work::compare() const {
  const Comparison c = held_out_.empty() ? emtb::compare(train_, now_.model, given_)
                                         : emtb::compare(held_out_, now_.model, given_, train_);
  return to_json(c, now_.model);
}

json Work::exported(const json& params) const {
  const rpc::Params checked(params);
  if (checked.text_or("format", "csv") != "csv") throw Error("a trace is exported as csv");
  const Record& run = record(checked.text("run"));
  std::string text = "signal,unit,t_s,measured,simulated\n";
  for (const Overlay& o : overlays(run, now_.model)) {
    const std::string head = std::string(info(o.signal).name) + "," + std::string(info(o.signal).unit) + ",";
    for (std::size_t i = 0; i < o.t.size(); ++i) {
      text += head + pretty(o.t[i], 9) + "," + pretty(o.measured[i], 9) + "," + pretty(o.simulated[i], 9) + "\n";
    }
  }
  return {{"name", short_name(run.name) + ".csv"}, {"text", text}};
}

}  // namespace emtb::page
