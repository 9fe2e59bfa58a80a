#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "config/profile_list.h"
#include "config/yaml.h"
#include "experiment/profile.h"
#include "figures/figure.h"
#include "figures/terminal.h"
#include "hal/printable.h"
#include "report/result_json.h"
#include "report/text.h"
#include "tools/commands.h"
#include "tools/offered_words.h"

namespace emtb {
namespace {

struct ProfilesOptions {
  std::string name, json_file;
};

nlohmann::ordered_json to_json(const ListedProfile& p) {
  return {{"name", p.name},           {"kind", p.kind},
          {"about", p.about},         {"duration_s", p.profile.duration()},
          {"min_V", p.profile.min()}, {"max_V", p.profile.max()},
          {"file", p.path.string()}};
}

std::string span_of(const ListedProfile& p) {
  return pretty(p.profile.duration(), 3) + " s, " + pretty(p.profile.min(), 3) + " to " + pretty(p.profile.max(), 3) +
         " V";
}

/// One profile: what it is for, its reference over time, and its file.
void show(const ListedProfile& p, const TerminalStyle& style) {
  const std::string kind = p.kind == p.name ? "" : p.kind + ", ";
  std::cout << p.name << ": " << kind << span_of(p) << "\n" << wrapped(p.about, width_of_prose()) << "\n";
  std::vector<double> t, u;
  for (const Knot& k : p.profile.knots()) {
    t.push_back(k.t);
    u.push_back(k.value);
  }
  Figure figure(p.name, "The reference over time.");
  figure.x({"t", "s"});
  figure.panel({"u_ref", "V"}).line("u_ref", t, u);
  std::cout << "\n"
            << to_terminal(figure, style) << "\n# " << p.path.string() << "\n"
            << printable(YamlMap::read_text(p.path), "\n\t");
}

int profiles_command(const ProfilesOptions& o) {
  const TerminalStyle style = style_of_stdout();
  if (!o.name.empty()) {
    const ListedProfile p = listed_profile(o.name);
    write_json(o.json_file, to_json(p));
    if (o.json_file != "-") show(p, style);
    return 0;
  }
  const std::vector<ListedProfile> all = shipped_profiles();
  nlohmann::ordered_json out{{"profiles", nlohmann::ordered_json::array()}};
  for (const ListedProfile& p : all) out["profiles"].push_back(to_json(p));
  write_json(o.json_file, out);
  if (o.json_file == "-") return 0;
  constexpr std::size_t indent = 4;
  for (const ListedProfile& p : all) {
    std::cout << p.name << "  (" << p.kind << ", " << span_of(p) << ")\n"
              << wrapped(p.about, width_of_prose(), indent) << "\n";
  }
  std::cout << wrapped("emtb profiles NAME shows one; emtb run NAME runs it on the bench", width_of_prose()) << "\n";
  return 0;
}

}  // namespace

void add_profiles_command(CommandLine& line) {
  const auto o = std::make_shared<ProfilesOptions>();
  line.command("profiles", "lists the experiments that come with emtb and what each is for, or shows one")
      .optional_argument("NAME", o->name, "one of the list, or the file of a profile of yours")
      .offers_beside_files(profile_names)
      .option("--json", o->json_file, "writes it to this file; - for standard output")
      .action([o] { return profiles_command(*o); });
}

}  // namespace emtb
