#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "config/model.h"
#include "config/profile.h"
#include "config/profile_path.h"
#include "config/shipped.h"
#include "figures/terminal.h"
#include "hal/error.h"
#include "hal/unit.h"
#include "model/catalogue.h"
#include "report/result_json.h"
#include "report/text.h"
#include "tools/commands.h"
#include "tools/effect_picture.h"
#include "tools/offered_words.h"

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

/// A row for each effect; where the terminal has no room for the equations they stand below, each on a line of its own.
void list_effects(std::size_t width) {
  Table whole({"id", "stage", "parameters", "equation"}, Table::Align::words);
  Table narrow({"id", "stage", "parameters"}, Table::Align::words);
  for (const EffectInfo& e : effect_catalogue()) {
    std::string parameters;
    for (const EffectParameter& p : e.parameters()) {
      parameters += (parameters.empty() ? "" : ", ") + std::string(p.symbol) + in_brackets(p.unit);
    }
    std::vector<std::string> row{std::string(e.id), std::string(name_of(e.stage)), parameters};
    narrow.row(row);
    row.emplace_back(e.equation);
    whole.row(std::move(row));
  }
  if (whole.width() <= width) {
    std::cout << whole.text();
    return;
  }
  std::istringstream rows(narrow.text());
  std::string line;
  std::getline(rows, line);
  std::cout << line.substr(0, width) << "\n";
  for (const EffectInfo& e : effect_catalogue()) {
    std::getline(rows, line);
    const std::string row = line.size() <= width ? line : wrapped(line, width);
    std::cout << row << "\n" << wrapped(std::string(e.equation), width, 4) << "\n";
  }
}

void explain(const EffectInfo& e) {
  const std::size_t width = width_of_prose();
  const auto prose = [&](const std::string& text) { std::cout << "\n" << wrapped(text, width) << "\n"; };
  std::cout << e.id << ": " << e.name << " (" << name_of(e.stage) << ")\n\n"
            << wrapped(std::string(e.equation), width, 4) << "\n";
  prose(std::string(e.what));
  prose("How it shows: " + std::string(e.shows));
  prose("Told apart: " + std::string(e.told_apart));
  std::cout << "\nParameters:\n";
  for (const EffectParameter& p : e.parameters()) {
    std::cout << "    " << p.symbol << in_brackets(p.unit) << (p.is_shape() ? ", usually about " : ", absent at ")
              << (p.is_shape() ? p.typical : p.null) << ", from " << p.min << " to " << p.max << "\n";
  }
  if (const std::string needs = needs_of(e); !needs.empty()) prose("Needs: " + needs);
  prose("Source: " + std::string(e.source));
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
    if (o.json_file != "-") list_effects(width_of_rows());
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
      .offers(effect_ids)
      .option("--json", o->json_file, "writes it to this file; - for standard output")
      .option("--picture", o->picture, "draws what the effect would leave of a model that lacks it, .svg or .png")
      .option("--model", o->model, "the model of the picture, which lacks the effect [models/desk.yaml]")
      .option("--profile", o->profile, "the run of the picture: a profile's file or name [desk_staircase]")
      .offers_beside_files(profile_names)
      .action([o] { return effects_command(*o); });
}

}  // namespace emtb
