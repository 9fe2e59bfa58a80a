#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>

#include "config/model.h"
#include "config/yaml.h"
#include "hal/error.h"
#include "tools/page/numbers.h"
#include "tools/page/work.h"

namespace emtb::page {
namespace {

constexpr int version = 1;

/// FNV-1a: names a file, guards nothing.
std::string hash(const std::string& text) {
  std::uint64_t h = 14695981039346656037u;
  for (const unsigned char c : text) h = (h ^ c) * 1099511628211u;
  std::string name;
  for (int shift = 60; shift >= 0; shift -= 4) name += "0123456789abcdef"[(h >> shift) & 15];
  return name;
}

double number_of(const json& value) {
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

json floors_json(const Noise& noise) {
  json out = json::object();
  for (const auto& [signal, f] : noise) {
    out[std::string(info(signal).name)] = {f.sigma,       static_cast<int>(f.from), f.lower_bound,
                                           f.upper_bound, f.relative_error,         f.autocorrelation};
  }
  return out;
}

Noise floors_of(const json& saved) {
  Noise noise;
  for (const auto& [name, f] : saved.items()) {
    const auto signal = signal_named(name);
    const int from = f.at(1);
    if (!signal || !(f.at(0) > 0) || from < 0 || from > static_cast<int>(FloorSource::assumed)) {
      throw Error("a floor is none");
    }
    noise[*signal] = {.sigma = f.at(0),
                      .from = static_cast<FloorSource>(from),
                      .lower_bound = f.at(2),
                      .upper_bound = f.at(3),
                      .relative_error = f.at(4),
                      .autocorrelation = f.at(5)};
  }
  return noise;
}

}  // namespace

void Work::save() const {
  const auto to_json = [](const State& s) {
    json steps = json::array();
    for (const Step& step : s.steps) steps.push_back({step.added, number(step.train), number(step.held_out)});
    json bounds = json::object();  // a model file knows none of what is fixed; the work frees it again
    const std::vector<std::string> names = s.model.names();
    for (std::size_t i = 0; i < names.size(); ++i) bounds[names[i]] = {s.model.at(i).min, s.model.at(i).max};
    return json{{"label", s.label},
                {"model", to_yaml(s.model)},
                {"bounds", bounds},
                {"steps", steps},
                {"at_bound", s.at_bound}};
  };
  json all{{"version", version}, {"train", train_specs_}, {"held_out", held_out_specs_}, {"now", to_json(now_)}};
  all["floors"] = floors_json(quieter_);
  all["past"] = all["future"] = json::array();
  for (const State& s : past_) all["past"].push_back(to_json(s));
  for (const State& s : future_) all["future"].push_back(to_json(s));
  std::error_code made;
  std::filesystem::create_directories(file_.parent_path(), made);
  const std::string beside = file_.string() + ".part";
  std::ofstream out(beside);
  out << all.dump(1) << "\n";
  if (!out.flush()) throw Error(file_.string() + ": the work cannot be saved there");
  std::error_code moved;
  std::filesystem::rename(beside, file_, moved);
  if (moved) throw Error(file_.string() + ": the work cannot be saved there (" + moved.message() + ")");
}

void Work::restore() {
  std::string key = YamlMap::read_text(files_.model) + "\n" + files_.map;
  for (const auto* specs : {&files_.sessions, &files_.held_out}) {
    key += "\n--";
    for (const std::string& spec : *specs) key += "\n" + std::filesystem::absolute(spec).string();
  }
  file_ = files_.state / ("page-" + hash(key) + ".json");
  std::ifstream in(file_);
  if (!in) return;
  const json all = json::parse(in, nullptr, false);
  try {
    if (!all.is_object() || all.at("version") != version) throw Error("of another version");
    const auto state = [](const json& s) {
      State out{.model = read_model(YamlMap::parse(s.at("model"), "saved work")),
                .steps = {},
                .at_bound = s.at("at_bound"),
                .label = s.at("label")};
      const std::vector<std::string> names = out.model.names();
      for (std::size_t i = 0; i < names.size(); ++i) {
        out.model.at(i).min = number_of(s.at("bounds").at(names[i]).at(0));
        out.model.at(i).max = number_of(s.at("bounds").at(names[i]).at(1));
      }
      for (const json& step : s.at("steps")) {
        out.steps.push_back({step.at(0), number_of(step.at(1)), number_of(step.at(2))});
      }
      return out;
    };
    State now = state(all.at("now"));
    std::vector<State> past, future;
    for (const json& s : all.at("past")) past.push_back(state(s));
    for (const json& s : all.at("future")) future.push_back(state(s));
    Noise floors = floors_of(all.value("floors", json::object()));
    train_specs_ = all.at("train");
    held_out_specs_ = all.at("held_out");
    quieter_ = std::move(floors);
    now_ = std::move(now);
    past_ = std::move(past);
    future_ = std::move(future);
  } catch (const std::exception&) {  // it stays for a person to look at; the work begins anew
    std::error_code ignored;
    std::filesystem::rename(file_, file_.string() + ".unreadable", ignored);
  }
}

}  // namespace emtb::page
