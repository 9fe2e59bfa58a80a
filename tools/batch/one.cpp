#include "tools/batch/one.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>

#include "analysis/diagnose/compare.h"
#include "analysis/diagnose/diagnose.h"
#include "analysis/fit/timing.h"
#include "config/mapping.h"
#include "config/model.h"
#include "emtb/version.h"
#include "hal/error.h"
#include "report/result_json.h"
#include "session/gaps.h"
#include "session/spec.h"
#include "tools/checked.h"

namespace emtb {
namespace {

using json = nlohmann::ordered_json;

std::string text_of(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// FNV-1a, 64 bits.
class Hash {
 public:
  void add(const std::string& text) {
    for (const char c : text + '\n') value_ = (value_ ^ static_cast<unsigned char>(c)) * 1099511628211U;
  }
  std::string text() const {
    std::ostringstream out;
    out << std::hex << value_;
    return out.str();
  }

 private:
  std::uint64_t value_ = 14695981039346656037U;
};

/// Size and time of a session's file; `none` where it is not there.
std::string state_of(const std::string& spec) {
  std::error_code error;
  const std::filesystem::path file = parse_session_spec(spec).path;
  const auto size = std::filesystem::file_size(file, error);
  if (error) return "none";
  const auto time = std::filesystem::last_write_time(file, error).time_since_epoch().count();
  return std::to_string(size) + " " + std::to_string(time);
}

json begun(const BatchItem& item, const std::string& key) {
  return {{"serial", item.serial}, {"time", item.time}, {"sessions", item.sessions}, {"key", key}, {"state", "done"}};
}

json bad(const BatchItem& item, const std::string& key, std::string why) {
  json out = begun(item, key);
  out["state"] = "bad";
  while (!why.empty() && why.back() == '\n') why.pop_back();
  out["message"] = why.substr(0, why.find('\n'));
  return out;
}

std::vector<Run> runs_of(const std::vector<std::string>& specs, const Mapping& mapping) {
  std::vector<Run> runs = read_runs(specs, mapping);
  refuse_slow_readings(runs);
  return runs;
}

void fit(const std::vector<Run>& train, const std::vector<Run>& held_out, const Model& model, json& out) {
  Dataset data = prepare(train, held_out, model);
  const Calibration c = calibrate(data, model);
  out["converged"] = c.converged;
  out["parameters"] = parameters_json(c.model);
  out["at_bound"] = c.at_bound;
  out["error"] = {{"train", number_json(error_on(data.train, c.model))},
                  {"held_out", data.held_out.empty() ? json(nullptr) : number_json(error_on(data.held_out, c.model))}};
}

void find_out(const std::vector<Run>& train, const std::vector<Run>& held_out, const Model& model, json& out) {
  const json found = to_json(diagnose(train, held_out, model, {}));
  out["parameters"] = found.at("parameters");
  out["error"] = found.at("error").at("final");
  out["verdict"] = found.at("verdict");
  out["missing"] = json::array();
  for (const json& missing : found.at("missing")) out["missing"].push_back(missing.at("id"));
}

void hold_against(const std::vector<Run>& train, const Model& model, json& out) {
  out["error"] = {{"train", number_json(compare(train, model).error)}, {"held_out", nullptr}};
}

/// When a session was recorded, where its file says so.
std::string recorded_at(const BatchItem& item) {
  const std::filesystem::path file = parse_session_spec(item.sessions.front()).path;
  if (file.extension() != ".h5") return {};
  const Session session = read_session(file);
  const auto found = session.attributes.find("started_utc");
  return found == session.attributes.end() ? std::string() : found->second;
}

}  // namespace

std::string key_of(const Manifest& manifest, const BatchItem& item) {
  Hash hash;
  for (const std::string& text : {std::string(version), name_of(manifest.work), item.serial, item.time,
                                  text_of(item.model), manifest.map.empty() ? "" : text_of(manifest.map)}) {
    hash.add(text);
  }
  hash.add(manifest.unchecked ? "unchecked" : "checked");
  for (const auto* specs : {&item.sessions, &item.held_out}) {
    for (const std::string& spec : *specs) {
      hash.add(spec);
      try {
        hash.add(state_of(spec));
      } catch (const Error&) {
        hash.add("no session");
      }
    }
    hash.add("held out");
  }
  return hash.text();
}

json work_on(const Manifest& manifest, const BatchItem& item, const std::string& key) {
  try {
    const Model model = read_model(item.model);
    const Mapping mapping = manifest.map.empty() ? Mapping{} : read_mapping(manifest.map);
    const std::vector<Run> given = runs_of(item.sessions, mapping), judges = runs_of(item.held_out, mapping);
    std::ostringstream said;
    if (!may_be_fitted(given, judges, model, manifest.unchecked, said)) return bad(item, key, said.str());
    const std::vector<Run> train = split_at_gaps(given, model.input), held_out = split_at_gaps(judges, model.input);
    json out = begun(item, key);
    if (item.time.empty()) out["time"] = recorded_at(item);
    if (manifest.work == BatchWork::calibrate) {
      fit(train, held_out, model, out);
    } else if (manifest.work == BatchWork::diagnose) {
      find_out(train, held_out, model, out);
    } else {
      hold_against(train, model, out);
    }
    return out;
  } catch (const std::bad_alloc&) {
    return bad(item, key, "takes more memory than there is");
  } catch (const std::exception& e) {
    return bad(item, key, e.what());
  }
}

json died_at(const BatchItem& item, const std::string& key, int times) {
  return bad(item, key, "the process died at it, " + std::to_string(times) + " times");
}

}  // namespace emtb
