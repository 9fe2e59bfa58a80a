#include "tests/blind/wide/wide_judge.h"

#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <set>
#include <sstream>

#include "hal/error.h"
#include "tests/blind/case_list.h"
#include "tests/blind/text.h"
#include "tests/blind/wide/asking.h"
#include "tests/blind/wide/command.h"
#include "tests/blind/wide/wide_table.h"

namespace emtb::blind::wide {
namespace {

struct Options {
  std::string cases = "single:20,healthy:12";
  std::filesystem::path out = "build/blind-wide", keep, json, against, emtb;
  std::vector<std::string> only;
  std::uint64_t seed = 1;
  double minutes = 1e6, longest = 600;
  std::size_t jobs = 1;
  bool resume = false, failures = false, manifest = false, tables_only = false, no_oracle = false;

  std::filesystem::path answers() const { return out / ("wide-" + std::to_string(seed) + ".jsonl"); }
};

using Wanted = WantedCase<Kind>;

std::vector<Wanted> plan(const Options& options) {
  return case_list(options.only, options.cases, wide_kind_named, "healthy, single, pair, triple, outside, garbage");
}

std::string folder_name(const Wanted& w) { return std::string(name_of(w.kind)) + "-" + std::to_string(w.number); }

/// What a case is, in a line that is the same on every machine.
std::string manifest_line(const WideCase& c, const CaseFiles& files) {
  std::ostringstream line;
  line << c.id << " " << c.seed << " " << std::hex << files.checksum << std::dec;
  for (const Truth& t : c.truths) line << " " << t.id << " x" << rounded(t.size, 3);
  if (c.garbage) line << " " << c.garbage->what;
  return line.str();
}

/// Makes one case in a folder, asks, and says so.
WideAnswer answer_to(const Wanted& w, const Options& options) {
  const bool keep = !options.keep.empty();
  const auto folder = (keep ? options.keep : options.out / "files") / folder_name(w);
  WideAnswer a;
  try {
    std::filesystem::remove_all(folder);
    const WideCase c = make_wide_case(w.kind, w.number, options.seed);
    const CaseFiles files = write_case(c, folder);
    if (options.manifest) {
      a = answer_not_made(w.kind, w.number, manifest_line(c, files));
    } else {
      a = ask(c, files, {.emtb = options.emtb, .longest = options.longest, .oracle = !options.no_oracle});
    }
  } catch (const std::exception& error) {
    a = answer_not_made(w.kind, w.number, std::string("not made: ") + error.what());
  }
  if (!keep)
    std::filesystem::remove_all(folder);
  else
    std::ofstream(folder / "answer.json") << to_json_line(a) << "\n";
  return a;
}

/// Runs the cases, each in a process of its own.
void run(const std::vector<Wanted>& list, const Options& options, const std::filesystem::path& file) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double, std::ratio<60>>(options.minutes);
  std::map<pid_t, Wanted> running;
  const auto await_one = [&] {
    int status = 0;
    const auto it = running.find(wait(&status));
    if (it == running.end()) return;
    if (WIFSIGNALED(status)) {
      const std::string why = "not made: ended by signal " + std::to_string(WTERMSIG(status));
      append(file, answer_not_made(it->second.kind, it->second.number, why));
      std::cout << "     " << it->second.id() << ": " << why << std::endl;
    } else if (WEXITSTATUS(status) != 0) {
      std::cerr << it->second.id() << ": its answer could not be written\n";
    }
    running.erase(it);
  };
  for (const Wanted& w : list) {
    if (std::chrono::steady_clock::now() > end) break;
    while (running.size() >= options.jobs) await_one();
    std::cout << std::flush;
    const pid_t child = fork();
    if (child < 0) throw Error("no process can be started");
    if (child == 0) {
      int code = 0;
      try {
        const WideAnswer a = answer_to(w, options);
        append(file, a);
        std::cout << (options.manifest ? a.verdict : line_of(a)) << std::endl;
      } catch (const std::exception& error) {
        std::cerr << error.what() << "\n";
        code = 1;
      }
      _exit(code);
    }
    running[child] = w;
  }
  while (!running.empty()) await_one();
}

/// Each answer that is not right, with the commands that make the case again and ask again.
void print_failures(const Options& options, const std::map<std::string, WideAnswer>& answers) {
  for (const auto& [id, a] : answers) {
    const bool garbage =
        !a.garbage.empty() && a.findings && a.contradicted &&
        std::ranges::none_of(*a.findings, [&](const auto& f) { return f.starts_with(a.garbage + " "); });
    if (!missed(a) && !garbage && false_findings(a).empty() && !a.verdict.starts_with("not made")) continue;
    std::string folder = id;
    std::ranges::replace(folder, ':', '-');
    std::cout << line_of(a) << "\n";
    for (const std::string& f : false_findings(a)) std::cout << "     false finding: " << f << "\n";
    std::cout << "     build/release/bin/blind_judge --wide --seed " << options.seed << " --only " << id
              << " --keep build/wide\n     cat build/wide/" << folder << "/{truth.json,command.txt}\n";
  }
}

/// Compares the cases made with those of another machine or day. @return how many differ
int compare(const std::map<std::string, WideAnswer>& answers, const std::filesystem::path& other) {
  std::ifstream in(other);
  if (!in) throw Error(other.string() + ": no such manifest");
  int differ = 0;
  for (std::string line; std::getline(in, line);) {
    const auto found = answers.find(line.substr(0, line.find(' ')));
    if (found == answers.end() || found->second.verdict == line) continue;
    std::cout << "differs: " << line << "\n     now: " << found->second.verdict << "\n";
    ++differ;
  }
  std::cout << differ << " cases differ from " << other.string() << "\n";
  return differ;
}

int make_manifest(const Options& options, const std::vector<Wanted>& list) {
  const auto file = options.out / ("made-" + std::to_string(options.seed) + ".jsonl");
  std::filesystem::remove(file);
  run(list, options, file);
  const auto made = answers_in(file, wide_answer_from);
  std::filesystem::remove(file);
  std::ofstream out(options.out / ("manifest-" + std::to_string(options.seed) + ".txt"));
  for (const Wanted& w : list) {
    const auto found = made.find(w.id());
    if (found != made.end()) out << found->second.verdict << "\n";
  }
  return options.against.empty() || compare(made, options.against) == 0 ? 0 : 1;
}

int judge_all(const Options& options) {
  std::filesystem::create_directories(options.out);
  const auto file = options.answers();
  if (options.failures) {
    print_failures(options, answers_in(file, wide_answer_from));
    return 0;
  }
  std::vector<Wanted> list = plan(options);
  if (options.manifest) return make_manifest(options, list);
  if (!options.only.empty()) {
    for (const Wanted& w : list) std::cout << line_of(answer_to(w, options)) << std::endl;
    return 0;
  }
  if (std::filesystem::exists(file) && !options.resume && !options.tables_only) {
    throw Error(file.string() + " holds answers already. Add --resume to go on with them, or give another --out");
  }
  const auto done = answers_in(file, wide_answer_from);
  std::erase_if(list, [&](const Wanted& w) { return done.contains(w.id()); });
  if (!options.tables_only) run(list, options, file);
  std::vector<WideAnswer> answers;
  for (auto& [id, answer] : answers_in(file, wide_answer_from)) answers.push_back(std::move(answer));
  std::cout << "\n" << wide_tables(answers);
  if (!options.json.empty()) std::ofstream(options.json) << wide_summary(answers);
  return 0;
}

}  // namespace

int wide_judge(int argc, char** argv) {
  Options options;
  options.emtb = std::filesystem::path(argv[0]).parent_path() / "emtb";
  bool wide = true;
  CLI::App app{"Judges the diagnosis on benches drawn from all that people have; docs/blind.md says what and how"};
  app.add_flag("--wide", wide, "this judge");
  app.add_option("--cases", options.cases,
                 "how many of each kind: healthy, single, pair, triple, outside, garbage; e.g. " + options.cases)
      ->capture_default_str();
  app.add_option("--only", options.only, "just this case, e.g. single:17; nothing is counted");
  app.add_option("--seed", options.seed, "another seed is another sample")->capture_default_str();
  app.add_option("--out", options.out, "folder of wide-SEED.jsonl, one line a case")->capture_default_str();
  app.add_option("--keep", options.keep, "folder for model, sessions, truth and answer of each case");
  app.add_option("--jobs", options.jobs, "cases at a time")->check(CLI::Range(1, 64))->capture_default_str();
  app.add_option("--json", options.json, "writes the rows of the table to this file");
  app.add_option("--minutes", options.minutes, "begin no further case after this time");
  app.add_option("--longest", options.longest, "seconds after which a diagnosis has failed")->capture_default_str();
  app.add_option("--emtb", options.emtb, "the program that is judged")->capture_default_str();
  app.add_option("--against", options.against, "with --manifest: compare with this one; exit 1 where cases differ");
  app.add_flag("--manifest", options.manifest,
               "only make the cases, and write OUT/manifest-SEED.txt with a checksum of each");
  app.add_flag("--failures", options.failures, "run nothing, list what was not right and how to ask it again");
  app.add_flag("--resume", options.resume, "go on where the file ends");
  app.add_flag("--tables-only", options.tables_only, "run nothing, count anew");
  app.add_flag("--no-oracle", options.no_oracle, "do not ask whether the data could tell");
  CLI11_PARSE(app, argc, argv);
  try {
    return judge_all(options);
  } catch (const std::exception& error) {
    std::cerr << "blind_judge: " << error.what() << "\n";
    return 2;
  }
}

}  // namespace emtb::blind::wide
