#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <set>
#include <thread>

#include "config/model.h"
#include "hal/error.h"
#include "model/catalogue.h"
#include "session/spec.h"
#include "tests/blind/answer.h"
#include "tests/blind/case_list.h"
#include "tests/blind/table.h"
#include "tests/blind/wide/wide_judge.h"

namespace emtb::blind {
namespace {

struct Options {
  std::string cases = "single:40,healthy:20,pair:10,outside:10";
  std::filesystem::path out = "build/blind", page = "docs/blind.md", keep;
  std::vector<std::string> only;
  std::uint64_t seed = 1;
  double minutes = 1e6;
  std::size_t jobs = std::max(1U, std::thread::hardware_concurrency());
  bool resume = false, known = false, brief = false, easy = false, tables_only = false;
};

using Wanted = WantedCase<CaseKind>;

bool library_knows(const Wanted& w) {
  if (w.kind == CaseKind::outside) return true;
  return std::ranges::all_of(subjects_of(w.kind, w.number), [](std::string_view id) {
    return std::ranges::find(effect_catalogue(), id, &EffectInfo::id) != effect_catalogue().end();
  });
}

/// `--only` asks for what it names, known or not.
std::vector<Wanted> plan(const Options& options) {
  std::vector<Wanted> list = case_list(options.only, options.cases, kind_named, "healthy, single, pair, outside");
  if (options.known && options.only.empty()) std::erase_if(list, [](const Wanted& w) { return !library_knows(w); });
  return list;
}

Answer answer_without_case(const Wanted& w, const std::string& verdict) {
  Answer a;
  a.id = w.id();
  a.kind = name_of(w.kind);
  for (const std::string_view subject : subjects_of(w.kind, w.number)) {
    a.truth.emplace_back(subject);
    a.size.push_back(0);
    a.right.push_back({std::string(subject)});
  }
  a.verdict = verdict;
  return a;
}

Setting setting_of(const Options& options) {
  return options.easy ? Setting::easy : options.brief ? Setting::brief : Setting::laboratory;
}

/// The case as files, so that a miss can be looked into with `emtb diagnose`.
void keep(const Case& c, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  write_model(folder / "model.yaml", c.bench.model);
  const auto write = [&](const std::vector<Run>& runs, const std::string& name) {
    for (std::size_t i = 0; i < runs.size(); ++i) {
      const auto path = folder / (name + "-" + std::to_string(i) + ".h5");
      std::filesystem::remove(path);
      write_session(path, {.runs = {runs[i]}, .events = {}, .attributes = {}, .config = {}, .complete = true});
    }
  };
  write(c.train, "train");
  write(c.held_out, "held-out");
}

Answer answer_to(const Wanted& w, const Options& options) {
  const auto start = std::chrono::steady_clock::now();
  try {
    const Case c = make_case(w.kind, w.number, options.seed, setting_of(options));
    const double making = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (!options.keep.empty()) keep(c, options.keep);
    Answer a = judge(c);
    a.making_seconds = making;
    return a;
  } catch (const std::exception& error) {
    return answer_without_case(w, std::string("not made: ") + error.what());
  }
}

/// Runs the cases, each in a process of its own: whatever happens to it, the others go on.
void run(const std::vector<Wanted>& list, const Options& options, const std::filesystem::path& file) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double, std::ratio<60>>(options.minutes);
  std::map<pid_t, Wanted> running;
  const auto await_one = [&] {
    int status = 0;
    const pid_t done = wait(&status);
    const auto it = running.find(done);
    if (it == running.end()) return;
    if (WIFSIGNALED(status)) {
      append(file, answer_without_case(it->second, "failed: ended by signal " + std::to_string(WTERMSIG(status))));
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
        const Answer a = answer_to(w, options);
        append(file, a);
        std::cout << line_of(a) << std::endl;
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

/// A file that ends in the middle of a line gets its end, so that the next line starts where lines start.
void finish_last_line(const std::filesystem::path& file) {
  std::fstream f(file, std::ios::in | std::ios::out | std::ios::binary);
  f.seekg(-1, std::ios::end);
  if (f && f.get() != '\n') {
    f.clear();
    f.seekp(0, std::ios::end);
    f.put('\n');
  }
}

int judge_all(const Options& options) {
  std::filesystem::create_directories(options.out);
  const std::filesystem::path file = options.out / ("seed-" + std::to_string(options.seed) + ".jsonl");
  std::vector<Wanted> list = plan(options);
  if (!options.only.empty()) {
    for (const Wanted& w : list) std::cout << to_json_line(answer_to(w, options)) << std::endl;
    return 0;
  }
  if (std::filesystem::exists(file)) {
    if (!options.resume && !options.tables_only) {
      throw Error(file.string() + " holds answers already. Add --resume to go on with them, or give another --out");
    }
    finish_last_line(file);
  }
  std::set<std::string> done;
  for (const auto& [id, answer] : answers_in(file, answer_from)) done.insert(id);
  std::erase_if(list, [&](const Wanted& w) { return done.contains(w.id()); });
  if (!options.tables_only) run(list, options, file);

  std::vector<Answer> answers;
  for (auto& [id, answer] : answers_in(file, answer_from)) answers.push_back(std::move(answer));
  std::cout << "\n" << tables(answers, {});
  if (options.page != "none") update_page(options.page, answers);
  return 0;
}

}  // namespace
}  // namespace emtb::blind

int main(int argc, char** argv) {
  setenv("XDG_CACHE_HOME", "/dev/null", 1);  // each case is worked out, whatever was asked before
  const auto wide = [](std::string_view word) { return word == "--wide"; };
  if (std::any_of(argv + 1, argv + argc, wide)) return emtb::blind::wide::wide_judge(argc, argv);
  emtb::blind::Options options;
  CLI::App app{"Judges the diagnosis on benches whose truth it cannot know; docs/blind.md says what and how"};
  app.add_option("--cases", options.cases, "how many of each kind: " + options.cases)->capture_default_str();
  app.add_option("--out", options.out, "folder of seed-N.jsonl, one line a case")->capture_default_str();
  app.add_option("--page", options.page, "page whose tables are written anew; none: no page")->capture_default_str();
  app.add_option("--only", options.only, "just this case, e.g. single:17: prints its line and keeps nothing");
  app.add_option("--keep", options.keep, "with --only: folder for the case's model and sessions");
  app.add_option("--seed", options.seed, "another seed is another sample")->capture_default_str();
  app.add_option("--minutes", options.minutes, "begin no further case after this time");
  app.add_option("--jobs", options.jobs, "cases at a time; 1 to measure the time of a diagnosis")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  app.add_flag("--resume", options.resume, "go on where the file ends");
  app.add_flag("--brief", options.brief, "recordings of a third of the time");
  app.add_flag("--easy", options.easy, "the same without nuisances, as in the tests");
  app.add_flag("--known", options.known, "leave out cases about effects that the library does not have");
  app.add_flag("--tables-only", options.tables_only, "run nothing, count anew");
  CLI11_PARSE(app, argc, argv);
  try {
    return emtb::blind::judge_all(options);
  } catch (const std::exception& error) {
    std::cerr << "blind_judge: " << error.what() << "\n";
    return 2;
  }
}
