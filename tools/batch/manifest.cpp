#include "tools/batch/manifest.h"

#include <fnmatch.h>

#include <algorithm>
#include <set>

#include "config/yaml.h"

namespace emtb {
namespace {

namespace fs = std::filesystem;

std::string beside(const fs::path& manifest, const std::string& path) {
  return fs::path(path).is_absolute() ? path : (manifest.parent_path() / path).lexically_normal().string();
}

std::vector<std::string> beside(const fs::path& manifest, std::vector<std::string> paths) {
  for (std::string& path : paths) path = beside(manifest, path);
  return paths;
}

BatchItem read_item(const YamlMap& item, const Manifest& manifest, const std::string& model) {
  item.only({"serial", "time", "session", "sessions", "held_out", "model"});
  BatchItem out;
  out.serial = item.text("serial");
  out.time = item.text_or("time", "");
  if (item.has("session") == item.has("sessions")) item.fail("sessions", "or `session` must be there, one of both");
  out.sessions = item.has("session") ? std::vector{item.text("session")} : item.texts("sessions");
  if (out.sessions.empty()) item.fail("sessions", "is empty. Name at least one session");
  if (item.has("held_out")) out.held_out = item.texts("held_out");
  out.sessions = beside(manifest.file, out.sessions);
  out.held_out = beside(manifest.file, out.held_out);
  out.model = item.has("model") ? beside(manifest.file, item.text("model")) : model;
  if (out.model.empty()) item.fail("model", "is missing, here and in the manifest itself");
  return out;
}

/// Each file that the pattern names, as a motor whose serial number is the file's name.
std::vector<BatchItem> items_of_files(const YamlMap& map, const Manifest& manifest, const std::string& model) {
  const fs::path pattern = beside(manifest.file, map.text("files"));
  const fs::path folder = pattern.has_parent_path() ? pattern.parent_path() : fs::path(".");
  if (model.empty()) map.fail("model", "is missing: `files` are fitted with it");
  std::vector<BatchItem> out;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (fnmatch(pattern.filename().c_str(), name.c_str(), FNM_PERIOD) != 0) continue;
    out.push_back({entry.path().stem().string(), {}, {(folder / name).string()}, {}, model});
  }
  if (error) map.fail("files", "folder " + folder.string() + " cannot be read: " + error.message());
  if (out.empty()) map.fail("files", "names no file: " + pattern.string() + ". * and ? may stand in the last part");
  std::ranges::sort(out, {}, &BatchItem::serial);
  return out;
}

BatchWork read_work(const YamlMap& map) {
  const std::string word = map.text_or("do", "calibrate");
  for (const BatchWork work : {BatchWork::calibrate, BatchWork::compare, BatchWork::diagnose}) {
    if (word == name_of(work)) return work;
  }
  map.fail("do", "is `" + word + "`. Write calibrate, compare or diagnose");
}

std::vector<BatchLimit> read_limits(const YamlMap& map) {
  std::vector<BatchLimit> out;
  const auto limits = map.map_if("limits");
  if (!limits) return out;
  for (const auto& [name, limit] : limits->entries()) {
    limit.only({"min", "max"});
    BatchLimit one{.of = name};
    if (limit.has("min")) one.min = limit.number("min");
    if (limit.has("max")) one.max = limit.number("max");
    if (one.min > one.max) limit.fail("min", "is above max");
    out.push_back(one);
  }
  if (out.size() != limits->keys().size()) {
    limits->fail("", "each limit is a map, such as K_b: {min: 0.040, max: 0.044}");
  }
  return out;
}

}  // namespace

std::string name_of(BatchWork work) {
  return work == BatchWork::calibrate ? "calibrate" : work == BatchWork::compare ? "compare" : "diagnose";
}

Manifest read_manifest(const fs::path& path) {
  const YamlMap map = YamlMap::load(path);
  map.only({"name", "do", "model", "map", "unchecked", "limits", "files", "items"});
  Manifest manifest;
  manifest.file = path;
  manifest.name = map.text_or("name", path.stem().string());
  manifest.work = read_work(map);
  if (map.has("map")) manifest.map = beside(path, map.text("map"));
  manifest.unchecked = map.flag_or("unchecked", false);
  manifest.limits = read_limits(map);
  const std::string model = map.has("model") ? beside(path, map.text("model")) : "";
  if (map.has("files")) manifest.items = items_of_files(map, manifest, model);
  std::set<std::string> serials;
  for (const BatchItem& item : manifest.items) serials.insert(item.serial);
  for (const YamlMap& item : map.maps("items")) {
    manifest.items.push_back(read_item(item, manifest, model));
    if (!serials.insert(manifest.items.back().serial).second) {
      item.fail("serial", "is `" + manifest.items.back().serial + "`, like another. Each must be unlike all others");
    }
  }
  if (manifest.items.empty()) map.fail("items", "is missing. Name the sessions, or give `files`, a pattern of them");
  return manifest;
}

}  // namespace emtb
