#include <algorithm>
#include <filesystem>
#include <iostream>
#include <sstream>

#include "config/bench.h"
#include "config/format.h"
#include "config/formula_effect.h"
#include "config/mapping.h"
#include "config/model.h"
#include "config/profile.h"
#include "config/schema.h"
#include "config/shipped.h"
#include "drivers/registry.h"
#include "figures/terminal.h"
#include "hal/error.h"
#include "hal/format_version.h"
#include "hal/printable.h"
#include "report/text.h"
#include "tools/bench_run.h"
#include "tools/commands.h"
#include "tools/rewrite.h"

namespace emtb {
namespace {

const char* const schema_file = "bench.schema.json";

struct ConfigOptions {
  std::string what;
  std::vector<std::string> files;
  bool yes = false;
};

/// `FILE:LINE` of a message
std::string place_of(const std::string& message, const std::string& file) {
  return message.substr(0, message.find(':', file.size() + 1));
}

/// What one file has wrong, a line each. A reader stops at the first thing; of a bench the schema knows the others,
/// too.
class FileCheck {
 public:
  explicit FileCheck(std::string file) : file_(std::move(file)) {}

  /// @return lines, in the file's order
  std::vector<std::string> complaints() {
    heard([&] { look(YamlMap::load(file_)); });
    return lines_;
  }
  const std::string& kind() const { return kind_; }

 private:
  void look(const YamlMap& yaml) {
    kind_ = kind_of(yaml);
    const auto keys = yaml.keys();
    const bool holds_maps = !keys.empty() && yaml.node()[keys.front()].IsMap();
    if (kind_.empty() && holds_maps && is_formula(yaml, keys.front())) kind_ = "candidates";
    if (kind_ == "bench") return look_at_bench(yaml);
    if (kind_ == "model") return void(read_model(yaml));
    if (kind_ == "profile") return void(read_experiment(yaml));
    if (kind_ == "mapping") return void(read_mapping(file_));
    if (kind_ == "candidates") return void(read_candidates(file_));
    yaml.fail("",
              "is no file of emtb's: a bench has `devices`, a model `parameters`, a profile `kind`, a mapping `time`");
  }

  void look_at_bench(const YamlMap& yaml) {
    read_format(yaml, "bench", newest_format::bench);
    for (const FileProblem& problem : schema_problems(yaml, shipped(schema_file))) lines_.push_back(problem.text);
    heard([&] {
      const BenchConfig bench = read_bench(file_);
      for (const std::string& line : complaints_of(bench)) add(line);
      if (bench.estimates) heard([&] { read_model(bench.estimates->model); });
    });
  }

  template <class Look>
  void heard(const Look& look_at) {
    try {
      look_at();
    } catch (const Error& e) {
      add(e.what());
    }
  }

  /// Unless that line of the file has been complained of.
  void add(const std::string& line) {
    const std::string place = place_of(line, file_) + ":";
    if (std::ranges::none_of(lines_, [&](const std::string& other) { return other.starts_with(place); }))
      lines_.push_back(line);
  }

  std::string file_, kind_;
  std::vector<std::string> lines_;
};

int check_files(const std::vector<std::string>& files) {
  int wrong = 0;
  for (const std::string& file : files) {
    FileCheck check(file);
    const auto complaints = check.complaints();
    for (const std::string& line : complaints) std::cout << fitted(line, width_of_rows());
    if (complaints.empty()) std::cout << file << ": " << check.kind() << ", nothing wrong\n";
    wrong += complaints.empty() ? 0 : 1;
  }
  return wrong > 0 ? 1 : 0;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// The lines that differ between what two texts have in common at their ends, with two lines around them.
void show_difference(const std::string& before, const std::string& after) {
  constexpr std::size_t around = 2;
  const auto old = lines_of(before), now = lines_of(after);
  const auto unlike = static_cast<std::size_t>(std::ranges::mismatch(old, now).in1 - old.begin());
  std::size_t same = 0;  // at the end
  while (same + unlike < std::min(old.size(), now.size()) && old[old.size() - 1 - same] == now[now.size() - 1 - same])
    ++same;
  const std::size_t begin = unlike > around ? unlike - around : 0;
  for (std::size_t i = begin; i < unlike; ++i) std::cout << "  " << printable(old[i], "\t") << "\n";
  for (std::size_t i = unlike; i + same < old.size(); ++i) std::cout << "- " << printable(old[i], "\t") << "\n";
  for (std::size_t i = unlike; i + same < now.size(); ++i) std::cout << "+ " << printable(now[i], "\t") << "\n";
  for (std::size_t i = old.size() - same; i < std::min(old.size(), old.size() - same + around); ++i)
    std::cout << "  " << printable(old[i], "\t") << "\n";
}

int upgrade_file(const std::string& name, bool yes) {
  const std::filesystem::path file = std::filesystem::weakly_canonical(name);  // a link stays one
  const std::string before = YamlMap::read_text(name);
  const std::string after = upgraded(before, name);
  if (after == before) {
    std::cout << name << ": is of the newest form already\n";
    return 0;
  }
  std::cout << name << ":\n";
  show_difference(before, after);
  if (!a_person_agrees("Write it?", "whether to write it", yes)) return 1;
  if (YamlMap::read_text(name) != before) throw Error(name + ": has changed meanwhile, and stays as it is");
  rewrite(file, after);
  std::cout << name << ": written\n";
  return 0;
}

int config_command(const ConfigOptions& o) {
  if (o.what == "schema") {
    std::cout << YamlMap::read_text(shipped(schema_file));
    return 0;
  }
  if (o.files.empty()) throw Error("emtb config " + o.what + ": which FILE?");
  if (o.what == "check") return check_files(o.files);
  int refused = 0;
  for (const std::string& file : o.files) refused = std::max(refused, upgrade_file(file, o.yes));
  return refused;
}

}  // namespace

void add_config_command(CommandLine& line) {
  const auto o = std::make_shared<ConfigOptions>();
  line.command("config",
               "check: all that is wrong in bench files, models, profiles and mappings, without any device; upgrade: "
               "writes a bench or a model in the newest form, after showing what changes; schema: prints the JSON "
               "schema of bench files")
      .argument("WHAT", o->what, "check, upgrade or schema")
      .one_of({"check", "upgrade", "schema"})
      .optional_arguments("FILE", o->files, "the YAML files")
      .flag("--yes", o->yes, "upgrade: writes without asking")
      .action([o] { return config_command(*o); });
}

}  // namespace emtb
