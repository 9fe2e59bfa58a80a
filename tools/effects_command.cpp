#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "config/model.h"
#include "config/profile.h"
#include "config/profile_path.h"
#include "config/shipped.h"
#include "hal/error.h"
#include "model/catalogue.h"
#include "report/result_json.h"
#include "report/text.h"
#include "tools/commands.h"
#include "tools/effect_picture.h"

namespace emtb {
namespace {

using json = nlohmann::ordered_json;

struct EffectsOptions {
  std::string effect, picture, model, json_file;
  std::string profile = "desk_staircase";
};

json effect_json(const EffectInfo& e) {
  json parameters = json::array();
  for (const EffectParameter& p : e.parameters()) {
    parameters.push_back({{"symbol", p.symbol},
                          {"unit", p.unit},
                          {"absent_at", p.is_shape() ? json(nullptr) : number_json(p.null)},
                          {"min", p.min},
                          {"max", p.max}});
  }
  return {{"id", e.id},           {"name", e.name},    {"stage", name_of(e.stage)},  {"equation", e.equation},
          {"what", e.what},       {"shows", e.shows},  {"told_apart", e.told_apart}, {"parameters", parameters},
          {"needs", needs_of(e)}, {"source", e.source}};
}

void list_effects() {
  Table table({"id", "stage", "parameters", "equation"});
  for (const EffectInfo& e : effect_catalogue()) {
    std::string parameters;
    for (const EffectParameter& p : e.parameters()) {
      parameters += (parameters.empty() ? "" : ", ") + std::string(p.symbol) + " [" + std::string(p.unit) + "]";
    }
    table.row({std::string(e.id), std::string(name_of(e.stage)), parameters, std::string(e.equation)});
  }
  std::cout << table.text();
}

void explain(const EffectInfo& e) {
  std::cout << e.id << ": " << e.name << " (" << name_of(e.stage) << ")\n\n    " << e.equation << "\n\n"
            << e.what << "\n\nHow it shows: " << e.shows << "\n\nTold apart: " << e.told_apart << "\n\nParameters:\n";
  for (const EffectParameter& p : e.parameters()) {
    std::cout << "    " << p.symbol << " [" << p.unit << "], absent at " << p.null << ", from " << p.min << " to "
              << p.max << "\n";
  }
  if (const std::string needs = needs_of(e); !needs.empty()) std::cout << "\nNeeds: " << needs << "\n";
  std::cout << "\nSource: " << e.source << "\n";
}

void draw(const EffectsOptions& o, std::size_t effect) {
  const Model model = read_model(o.model.empty() ? shipped("models/desk.yaml").string() : o.model);
  if (model.includes(effect)) throw Error("the model includes " + o.effect + " already: give one that lacks it");
  const NamedFigure picture = effect_picture(effect, model, read_profile(profile_path(o.profile)));
  if (o.picture.ends_with(".png")) {
    write_png(picture.figure, o.picture);
  } else if (o.picture.ends_with(".svg")) {
    write_svg(picture.figure, o.picture);
  } else {
    throw Error("--picture " + o.picture + ": must end in .svg or .png");
  }
}

int effects_command(const EffectsOptions& o) {
  if (o.effect.empty()) {
    if (!o.picture.empty()) throw Error("--picture needs an ID: a picture is of one effect");
    if (o.json_file != "-") list_effects();
    json all = json::array();
    for (const EffectInfo& e : effect_catalogue()) all.push_back(effect_json(e));
    write_json(o.json_file, all);
    return 0;
  }
  const std::size_t effect = effect_index(o.effect);
  if (!o.picture.empty()) draw(o, effect);
  if (o.json_file != "-") explain(effect_catalogue()[effect]);
  write_json(o.json_file, effect_json(effect_catalogue()[effect]));
  return 0;
}

}  // namespace

void add_effects_command(CommandLine& line) {
  const auto o = std::make_shared<EffectsOptions>();
  line.command("effects", "lists the physical effects that a model can include, or explains one")
      .optional_argument("ID", o->effect, "the effect to explain")
      .option("--json", o->json_file, "writes it to this file; - for standard output")
      .option("--picture", o->picture, "draws what the effect would leave of a model that lacks it, .svg or .png")
      .option("--model", o->model, "the model of the picture, which lacks the effect [models/desk.yaml]")
      .option("--profile", o->profile, "the run of the picture: a profile's file or name [desk_staircase]")
      .action([o] { return effects_command(*o); });
}

}  // namespace emtb
