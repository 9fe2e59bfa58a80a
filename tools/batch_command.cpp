#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "analysis/numerics/parallel.h"
#include "hal/error.h"
#include "report/progress.h"
#include "tools/batch/claims.h"
#include "tools/batch/manifest.h"
#include "tools/batch/one.h"
#include "tools/batch/rank.h"
#include "tools/batch/table.h"
#include "tools/commands.h"

namespace emtb {
namespace {

namespace fs = std::filesystem;
using json = nlohmann::ordered_json;

constexpr int most_deaths = 3;  // of processes at one item, until it counts as bad

struct BatchOptions {
  std::string manifest, out, shard;
  int jobs = 0;
  double patience = 60;  // [s]
};

/// One process of those that work on a manifest.
class BatchWorker {
 public:
  BatchWorker(const Manifest& manifest, const fs::path& folder, double patience)
      : manifest_(manifest),
        folder_(folder),
        claims_(folder / "claims", patience),
        keys_(manifest.items.size()),
        results_(manifest.items.size()) {
    fs::create_directories(folder / "items");
    for (std::size_t i = 0; i < keys_.size(); ++i) keys_[i] = key_of(manifest, manifest.items[i]);
  }

  /// Works until there is a result of each item, whoever made it.
  void work(const Rank& rank, std::size_t jobs) {
    const std::size_t n = manifest_.items.size();
    const std::size_t begin = rank.number * n / rank.of;
    bool all = false;
    for (int round = 0; !all; ++round) {
      if (round > 0) std::this_thread::sleep_for(std::chrono::milliseconds(std::min(1000, 20 * round)));
      std::atomic<std::size_t> next{0};
      std::atomic<bool> missing{false};
      parallel_workers(jobs, [&] {
        const OneThreadHere alone;
        for (std::size_t k = next++; k < n; k = next++) {
          if (!settle((begin + k) % n)) missing = true;
        }
      });
      all = !missing;
    }
    progress_.clear();
  }

  /// The tables, by one of those that see all results. @return what they say
  BatchTable merge() {
    std::vector<json> results;
    for (const auto& result : results_) results.push_back(*result);
    BatchTable table = make_table(manifest_, results);
    const fs::path made = folder_ / "made";
    const std::string state = state_of_tables();
    for (int round = 0; text_of(made) != state; ++round) {
      if (round > 0) std::this_thread::sleep_for(std::chrono::milliseconds(100));
      if (claims_.take("tables") == 0) continue;
      write_tables(table, folder_);
      replace_with_text(made, state);
      claims_.let_go("tables");
    }
    claims_.clear("tables");
    return table;
  }

 private:
  template <class Work>
  static void parallel_workers(std::size_t jobs, const Work& work) {
    std::exception_ptr failure;
    std::mutex mutex;
    const auto guarded = [&] {
      try {
        work();
      } catch (...) {
        const std::lock_guard lock(mutex);
        failure = std::current_exception();
      }
    };
    std::vector<std::jthread> threads;
    for (std::size_t j = 1; j < jobs; ++j) threads.emplace_back(guarded);
    guarded();
    threads.clear();
    if (failure) std::rethrow_exception(failure);
  }

  fs::path file_of(std::size_t i) const { return folder_ / "items" / (number_of(i) + ".json"); }

  static std::string number_of(std::size_t i) {
    std::string number = std::to_string(i + 1);
    return number.insert(0, 6 - std::min<std::size_t>(6, number.size()), '0');
  }

  static std::string text_of(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  /// The result that lies there, where it is that of this question.
  std::optional<json> found(std::size_t i) const {
    const json result = json::parse(text_of(file_of(i)), nullptr, false);
    if (!result.is_object() || result.value("key", "") != keys_[i]) return std::nullopt;
    if (!result.contains("state") || !result.contains("serial")) return std::nullopt;
    return result;
  }

  /// Sees to one item. @return whether its result is there
  bool settle(std::size_t i) {
    if (results_[i]) return true;
    results_[i] = found(i);
    const std::string claim = number_of(i);
    if (results_[i]) {
      claims_.clear(claim);
    } else {
      const int times = claims_.take(claim);
      if (times == 0) return false;  // another works at it
      results_[i] = found(i);        // which it may have done meanwhile
      if (!results_[i]) {
        results_[i] = times > most_deaths ? died_at(manifest_.items[i], keys_[i], times - 1)
                                          : work_on(manifest_, manifest_.items[i], keys_[i]);
        replace_with_text(file_of(i), results_[i]->dump(1) + "\n");
      }
      claims_.let_go(claim);
    }
    const std::size_t done = ++done_;
    const std::lock_guard lock(mutex_);
    progress_.show(static_cast<double>(done) / static_cast<double>(keys_.size()),
                   std::to_string(done) + " of " + std::to_string(keys_.size()));
    return true;
  }

  /// Changes with any result and any limit.
  std::string state_of_tables() const {
    std::size_t all = std::hash<std::string>()(manifest_.name);
    const auto mix = [&](const std::string& text) { all = all * 1099511628211U ^ std::hash<std::string>()(text); };
    for (const auto& result : results_) mix(result->dump());
    for (const BatchLimit& limit : manifest_.limits) {
      mix(limit.of + " " + std::to_string(limit.min) + " " + std::to_string(limit.max));
    }
    return std::to_string(all);
  }

  const Manifest& manifest_;
  fs::path folder_;
  Claims claims_;
  std::vector<std::string> keys_;
  std::vector<std::optional<json>> results_;
  std::atomic<std::size_t> done_{0};
  std::mutex mutex_;
  Progress progress_;
};

/// All cores, or this rank's share of them.
std::size_t jobs_of(const BatchOptions& o, const Rank& rank) {
  if (o.jobs < 0) throw Error("--jobs takes 1 or more");
  if (o.jobs > 0) return static_cast<std::size_t>(o.jobs);
  return std::max<std::size_t>(1, std::thread::hardware_concurrency() / rank.on_machine);
}

int batch_command(const BatchOptions& o) {
  if (!(o.patience > 0)) throw Error("--patience takes seconds above 0");
  const Rank rank = find_rank(o.shard, [](const char* name) { return std::getenv(name); });
  const Manifest manifest = read_manifest(o.manifest);
  const fs::path folder = o.out.empty() ? fs::path(o.manifest).replace_extension(".batch") : fs::path(o.out);
  BatchWorker worker(manifest, folder, o.patience);
  worker.work(rank, jobs_of(o, rank));
  const BatchTable table = worker.merge();
  if (rank.number != 0) return 0;  // mpirun ends all ranks as soon as one ends with another code
  const std::size_t n = table.rows.size(), passed = table.passed(), bad = table.bad();
  std::cout << n << (n == 1 ? " motor: " : " motors: ") << passed << " pass, " << n - passed - bad << " fail, " << bad
            << " bad\n";
  for (const char* file : {"table.csv", "table.h5", "index.html"}) {
    std::cout << "written: " << (folder / file).string() << "\n";
  }
  return passed == n ? 0 : 1;
}

}  // namespace

void add_batch_command(CommandLine& line) {
  const auto o = std::make_shared<BatchOptions>();
  line.command("batch", "fits, compares or diagnoses many motors: all cores, and many processes that share a folder")
      .argument("MANIFEST", o->manifest,
                "what is done to which sessions, and the limits that pass: YAML, docs/batch.md")
      .option("--out", o->out,
              "the folder of results, shared by all who work at them [MANIFEST without its ending, .batch]")
      .option("--shard", o->shard, "K/N: this is process K of N [what Open MPI or Slurm say]")
      .option("--jobs", o->jobs, "how many sessions at a time in this process [one a core]")
      .option("--patience", o->patience, "[s] after which work of another machine that gives no sign is taken over")
      .action([o] { return batch_command(*o); });
}

}  // namespace emtb
