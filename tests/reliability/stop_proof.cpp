// Stops the bench again and again, at idle and in runs, while others do their worst at the daemon's socket; looks how
// long each stop takes to be answered, which it is when the reference is safe.
//
//     stop_proof [--stops N] [--runs N] [--within SECONDS]
//
// Exit 0: under each attack 999 of 1000 stops were answered within that time, and every run ended by its stop.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <functional>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>
#include <vector>

#include "hal/error.h"
#include "server/client.h"
#include "server/unix_socket.h"
#include "tests/emtbd.h"
#include "tests/process.h"
#include "tests/raw_client.h"

namespace emtb {
namespace {

using nlohmann::json;

const char* const profile = "name: stopped\nkind: step\nlevel: 3\nbefore: 0\nhold: 100\nafter: 0\n";

struct Options {
  int stops = 1000;
  int runs = 20;
  double within = 0.1;  // [s]
};

/// Others, who go on until they are told to end.
struct Attack {
  const char* name;
  int attackers;
  std::function<void(const std::filesystem::path& socket, unsigned seed, const std::atomic<bool>& quit)> act;
};

std::string request(const std::string& method, const json& params) {
  return json{{"jsonrpc", "2.0"}, {"id", 1}, {"method", method}, {"params", params}}.dump() + "\n";
}

void send_over_and_over(const std::filesystem::path& socket, const std::string& line, const std::atomic<bool>& quit) {
  while (!quit) {
    RawClient client(socket);
    for (int i = 0; i < 100 && !quit && client.connected; ++i) {
      client.send_what_fits(line);
      if (client.line(1).empty()) break;
    }
  }
}

std::string formulas(int count) {
  std::string text =
      "name: m\ninput: e_a\nparameters:\n  R_a: {value: 30, min: 5, max: 100, unit: ohm}\n  K_b: {value: 0.6, min: "
      "0.1, max: 2, unit: V s/rad}\n  K_m: {value: 0.6, min: 0.1, max: 2, unit: N m/A}\n  B: {value: 3.0e-4, min: 0, "
      "max: 0.01, unit: N m s/rad}\n  J: {value: 4.0e-3, min: 2.0e-4, max: 0.1, unit: kg m2}\neffects:\n";
  for (int i = 0; i < count; ++i) {
    const std::string n = std::to_string(i);
    text += "  f" + n + ": {torque: \"-c" + n + "*omega^3\", parameters: {c" + n +
            ": {value: 0, min: 0, max: 1.0e-6, unit: N m s3/rad3}}}\n";
  }
  return text;
}

std::vector<Attack> attacks() {
  const auto over_and_over = [](std::string line) {
    return [line = std::move(line)](const auto& socket, unsigned, const auto& quit) {
      send_over_and_over(socket, line, quit);
    };
  };
  const auto stay = [](const auto& socket, unsigned, const auto& quit) {
    std::vector<std::unique_ptr<RawClient>> crowd;
    for (std::size_t i = 0; i < 2 * UnixSocketServer::most_clients; ++i) {
      crowd.push_back(std::make_unique<RawClient>(socket));
      crowd.back()->send_what_fits(request("subscribe", {{"rate", 50}}));  // and never read
    }
    while (!quit) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  };
  std::string points = "0";
  for (int i = 1; i < 100'000; ++i) points += ", " + std::to_string(i);
  return {
      {"nobody", 0, {}},
      {"ten who ask for status", 10, over_and_over(request("status", json::object()))},
      {"ten who send newlines", 10, over_and_over(std::string(60'000, '\n'))},
      {"a crowd that never reads", 1, stay},
      {"four with models of 500 formulas", 4, over_and_over(request("estimates", {{"model", formulas(500)}}))},
      {"four with the largest models that are taken", 4, over_and_over(request("estimates", {{"model", formulas(8)}}))},
      {"two with profiles of half a megabyte", 2,
       over_and_over(request("run", {{"profile", "name: x\nkind: knots\ntimes: [" + points + "]\nvalues: [0]\n"}}))},
      {"two who arm", 2, over_and_over(request("reset", json::object()))}};
}

class Proof {
 public:
  explicit Proof(const Options& options) : options_(options) {
    std::string pattern = std::filesystem::temp_directory_path() / "emtb-stop-XXXXXX";
    if (mkdtemp(pattern.data()) == nullptr) throw Error(pattern + ": no temporary folder");
    folder_ = pattern;
    std::filesystem::copy_file(std::filesystem::path(EMTB_CONFIG) / "benches/fh2-simulated.yaml",
                               folder_ / "bench.yaml");
    daemon_ = std::make_unique<Process>(emtbd_words(folder_ / "bench.yaml", folder_), folder_ / "emtbd");
    owner_ = client_of(*daemon_, folder_ / "s");
    if (!owner_) throw Error("emtbd does not answer: " + daemon_->err());
  }
  ~Proof() {
    owner_.reset();
    daemon_.reset();
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  bool survive(const Attack& attack) {
    std::atomic<bool> quit{false};
    std::vector<std::thread> others;
    for (int i = 0; i < attack.attackers; ++i) {
      others.emplace_back([&, seed = static_cast<unsigned>(i)] { attack.act(folder_ / "s", seed, quit); });
    }
    std::vector<double> took;  // [s]
    bool all_safe = true;
    for (int i = 0; i < options_.stops; ++i) took.push_back(stop(all_safe));
    int ended = 0, begun = 0;
    for (int i = 0; i < options_.runs; ++i) {
      if (!begin()) continue;
      ++begun;
      took.push_back(stop(all_safe));
      ended += last_["stopped"].is_number();
    }
    quit = true;
    for (std::thread& other : others) other.join();
    std::ranges::sort(took);
    const auto at = [&](double share) {
      return 1e3 * took[static_cast<std::size_t>(share * static_cast<double>(took.size() - 1))];
    };
    const bool good = at(0.999) <= 1e3 * options_.within && all_safe && ended == begun && begun > 0;
    std::printf("%-45s %zu stops: median %.2f ms, 99.9 %% %.1f ms, at most %.1f ms; %d of %d runs ended%s\n",
                attack.name, took.size(), at(0.5), at(0.999), at(1), ended, begun, good ? "" : "  NOT GOOD");
    std::fflush(stdout);
    return good;
  }

 private:
  double stop(bool& all_safe) {
    const auto begin = std::chrono::steady_clock::now();
    last_ = stop_now(folder_ / "s");
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    all_safe = all_safe && last_["reference_safe"] == true;
    return took.count();
  }
  /// A run, on a socket where others do their worst: again until it is on.
  bool begin() {
    return eventually(
        [&] {
          try {
            if (owner_->call("status", json::object())["state"] != "armed") owner_->call("reset", json::object());
            owner_->call("run", {{"profile", profile}});
            return eventually([&] { return owner_->call("status", json::object())["state"] == "running"; }, 5);
          } catch (const ProtocolError&) {
            return false;
          }
        },
        60);
  }

  const Options options_;
  std::filesystem::path folder_;
  std::unique_ptr<Process> daemon_;
  std::unique_ptr<Client> owner_;
  json last_;
};

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string word = argv[i];
    if (word == "--stops") options.stops = std::stoi(argv[i + 1]);
    if (word == "--runs") options.runs = std::stoi(argv[i + 1]);
    if (word == "--within") options.within = std::stod(argv[i + 1]);
  }
  return options;
}

}  // namespace
}  // namespace emtb

int main(int argc, char** argv) {
  try {
    emtb::Proof proof(emtb::parse(argc, argv));
    bool good = true;
    for (const auto& attack : emtb::attacks()) good = proof.survive(attack) && good;
    return good ? 0 : 1;
  } catch (const std::exception& e) {
    std::cerr << "stop_proof: " << e.what() << "\n";
    return 2;
  }
}
