// Asks emtbd 100,000 malformed, huge, half and right requests, and lets 1,000 clients connect that never read; looks
// whether the loop, the memory and those with manners notice.
//
//     flood_proof [--requests N] [--clients N] [--seconds S] [--seed N] [--grow-at-most MIB]
//
// Exit 0: every whole line was answered, memory grew by no more than that, and the bench runs afterwards as ever.
// What the loop did is printed side by side, before and during: the machine's own stalls are in both.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>
#include <vector>

#include "hal/error.h"
#include "server/client.h"
#include "server/unix_socket.h"
#include "session/spec.h"
#include "tests/process.h"
#include "tests/raw_client.h"

namespace emtb {
namespace {

using nlohmann::json;

constexpr int talkers = 20;  // that send at the same time
const char* const profile = "name: flooded\nkind: step\nlevel: 3\nbefore: 0\nhold: 100\nafter: 0\n";

/// A request of one of many bad kinds, or a right one.
std::string request(std::mt19937& random) {
  const auto noise = [&random](std::size_t size) {
    std::string text(size, ' ');
    for (char& c : text) {
      c = static_cast<char>(random());
      if (c == '\n' || c == '\r') c = 'n';
    }
    return text;
  };
  switch (random() % 9) {
    case 0:
      return noise(1 + random() % 200) + "\n";
    case 1:
      return std::string(1 + random() % 5000, '[') + "\n";
    case 2:
      return R"({"jsonrpc":"2.0","id":1,"method":"run","params":{"profile":")" + std::string(60'000, 'x') + "\"}}\n";
    case 3:
      return R"({"jsonrpc":"2.0","id":1,"method":")" + std::to_string(random()) + "\"}\n";
    case 4:
      return R"({"jsonrpc":"2.0","id":1e999,"method":"status","params":[1,2]})"
             "\n";
    case 5:
      return R"({"jsonrpc":"2.0","id":1,"method":"run","params":{"profile":"name: x\nkind: )" +
             std::to_string(random()) + "\\n\"}}\n";
    case 6:
      return R"({"jsonrpc":"2.0","id":1,"method":"subscribe","params":{"rate":-1}})"
             "\n";
    case 7:
      return "{}\n";
    default:
      return R"({"jsonrpc":"2.0","id":1,"method":"status"})"
             "\n";
  }
}

struct Options {
  int requests = 100'000;
  int clients = 1000;
  double seconds = 10;  // of quiet before
  unsigned seed = 1;
  double grow_at_most = 16;  // [MiB] queues of all clients together can take 20, of which few are full at once
};

using Histogram = std::map<double, double>;  // [us] upper edge, count

Histogram lateness(Client& daemon) {
  Histogram histogram;
  const json status = daemon.call("status", {});
  for (const json& bin : status["loop"]["late_histogram"]) {
    histogram[bin[0].get<double>()] = bin[1].get<double>();
  }
  return histogram;
}

double percentile(const Histogram& before, const Histogram& after, double share) {
  double total = 0, sum = 0;
  const auto count = [&](const auto& bin) {
    const auto old = before.find(bin.first);
    return bin.second - (old == before.end() ? 0 : old->second);
  };
  for (const auto& bin : after) total += count(bin);
  for (const auto& bin : after) {
    if ((sum += count(bin)) >= share * total) return bin.first;
  }
  return 0;
}

/// [MiB] resident
double memory(int pid) {
  std::ifstream statm("/proc/" + std::to_string(pid) + "/statm");
  double size = 0, resident = 0;
  statm >> size >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

/// Sends its share and reads every answer. @return how many were answered
int talk(const std::filesystem::path& socket, int requests, unsigned seed) {
  std::mt19937 random(seed);
  auto client = std::make_unique<RawClient>(socket);
  int answered = 0;
  for (int i = 0; i < requests; ++i) {
    if (i % 100 == 50) {  // half a request, and gone
      client->send(R"({"jsonrpc":"2.0","id":1,"me)");
      client = std::make_unique<RawClient>(socket);
    }
    if (i % 1000 == 500) {  // a line that never ends
      client->send(std::string(UnixSocketServer::longest_line + 1, 'x'));
      client = std::make_unique<RawClient>(socket);
    }
    if (client->send(request(random)) && !client->line().empty()) ++answered;
  }
  return answered;
}

/// Ask much, read nothing.
void ask_and_never_read(const std::filesystem::path& socket, int clients) {
  std::vector<std::unique_ptr<RawClient>> held;
  for (int i = 0; i < clients; ++i) {
    held.push_back(std::make_unique<RawClient>(socket));
    held.back()->send_what_fits("{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"subscribe\",\"params\":{\"rate\":50}}\n");
    for (int n = 0; n < 200; ++n) held.back()->send_what_fits("{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"status\"}\n");
    if (held.size() > 30) held.erase(held.begin());  // places for the others
  }
}

bool prove(const Options& options) {
  std::string pattern = std::filesystem::temp_directory_path() / "emtb_flood_XXXXXX";
  if (mkdtemp(pattern.data()) == nullptr) throw Error("no temporary folder");
  const std::filesystem::path folder = pattern;
  std::filesystem::copy_file(std::filesystem::path(EMTB_CONFIG) / "benches/desk-simulated.yaml", folder / "bench.yaml");
  Process emtbd({EMTBD, "--config", folder / "bench.yaml", "--socket", folder / "s", "--data", folder / "data"},
                folder / "emtbd");
  std::unique_ptr<Client> daemon;
  const bool answers = eventually([&] {
    try {
      daemon = std::make_unique<Client>(folder / "s");
      daemon->call("status", {});
      return true;
    } catch (const ProtocolError&) {
      return false;
    }
  });
  if (!answers) throw Error("emtbd does not answer: " + emtbd.err());

  const auto pass = [&] { ask_and_never_read(folder / "s", std::min(options.clients, 100)); };
  pass();  // what the allocator keeps for good
  talk(folder / "s", 200, options.seed);
  const double before = memory(emtbd.pid());
  const Histogram start = lateness(*daemon);
  std::this_thread::sleep_for(std::chrono::duration<double>(options.seconds));
  const Histogram quiet = lateness(*daemon);
  const double missed = daemon->call("status", {})["loop"]["missed"];

  std::vector<std::thread> threads;
  std::vector<int> answered(talkers);
  for (int i = 0; i < talkers; ++i) {
    threads.emplace_back([&, i] {
      answered[static_cast<std::size_t>(i)] =
          talk(folder / "s", options.requests / talkers, options.seed + 1 + static_cast<unsigned>(i));
    });
  }
  threads.emplace_back([&] { ask_and_never_read(folder / "s", options.clients); });
  double slowest = 0;  // [s] of somebody with manners
  for (bool busy = true; busy;) {
    const auto asked = std::chrono::steady_clock::now();
    daemon->call("status", {});
    slowest = std::max(slowest, std::chrono::duration<double>(std::chrono::steady_clock::now() - asked).count());
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    busy = std::ranges::any_of(answered, [](int n) { return n == 0; });
  }
  for (std::thread& thread : threads) thread.join();
  const Histogram flooded = lateness(*daemon);
  const json status = daemon->call("status", {});
  const double after = memory(emtbd.pid());
  int all = 0;
  for (const int n : answered) all += n;
  const int whole = options.requests / talkers * talkers;

  std::printf("%d of %d requests answered, %d clients never read; slowest answer to another client %.0f ms\n", all,
              whole, options.clients, 1e3 * slowest);
  std::printf(
      "loop late by: before %.0f us (50 %%), %.0f us (99 %%); during %.0f us (50 %%), %.0f us (99 %%); missed %.0f\n",
      percentile(start, quiet, 0.5), percentile(start, quiet, 0.99), percentile(quiet, flooded, 0.5),
      percentile(quiet, flooded, 0.99), status["loop"]["missed"].get<double>() - missed);
  std::printf("memory: before %.1f MiB, after %.1f MiB\n", before, after);

  daemon->call("reset", {});  // the bench is at hand as ever
  const json started = daemon->call("run", {{"profile", profile}});
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  daemon->call("stop", {});
  const bool ended = eventually([&] { return daemon->call("status", {})["run"].is_null(); });
  const bool readable = ended && read_session(started["session"].get<std::string>()).complete;
  emtbd.signal(SIGTERM);
  const bool well = emtbd.wait() == 0;
  std::error_code ignored;
  std::filesystem::remove_all(folder, ignored);
  return all == whole && after - before <= options.grow_at_most && readable && well;
}

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; i += 2) {
    const std::string word = argv[i];
    if (i + 1 >= argc) throw Error(word + ": wants a value, or is not known");
    const double value = std::stod(argv[i + 1]);
    if (word == "--requests") {
      options.requests = static_cast<int>(value);
    } else if (word == "--clients") {
      options.clients = static_cast<int>(value);
    } else if (word == "--seconds") {
      options.seconds = value;
    } else if (word == "--seed") {
      options.seed = static_cast<unsigned>(value);
    } else if (word == "--grow-at-most") {
      options.grow_at_most = value;
    } else {
      throw Error(word + ": not known. Known: --requests, --clients, --seconds, --seed, --grow-at-most");
    }
  }
  return options;
}

}  // namespace
}  // namespace emtb

int main(int argc, char** argv) {
  try {
    return emtb::prove(emtb::parse(argc, argv)) ? 0 : 1;
  } catch (const std::exception& e) {
    std::cerr << "flood_proof: " << e.what() << "\n";
    return 2;
  }
}
