#pragma once

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "server/client.h"
#include "tests/process.h"

namespace emtb {

/// What starts emtbd on a bench, with its socket at FOLDER/s and its sessions in FOLDER/data.
inline std::vector<std::string> emtbd_words(const std::filesystem::path& bench, const std::filesystem::path& folder,
                                            const std::vector<std::string>& more = {}) {
  std::vector<std::string> words{
      EMTBD, "--config", bench.string(), "--socket", (folder / "s").string(), "--data", (folder / "data").string()};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

/// The process that makes safe when this one dies; 0 where there is none.
inline int guardian_of(const Process& emtbd) {
  const std::string process = std::to_string(emtbd.pid());
  std::ifstream children("/proc/" + process + "/task/" + process + "/children");
  for (int child = 0; children >> child;) {
    std::ifstream comm("/proc/" + std::to_string(child) + "/comm");
    std::string name;
    if (comm >> name && name == "emtb-safe") return child;
  }
  return 0;
}

/// Kills both, the guardian seeing nothing. @return whether there was one
inline bool kill_with_guardian(Process& emtbd) {
  const int guardian = guardian_of(emtbd);
  if (guardian > 0) kill(guardian, SIGSTOP);
  emtbd.signal(SIGKILL);
  emtbd.wait();
  if (guardian > 0) kill(guardian, SIGKILL);
  return guardian > 0;
}

/// A client as soon as the daemon answers; null where it ends, or never does.
inline std::unique_ptr<Client> client_of(Process& emtbd, const std::filesystem::path& socket) {
  std::unique_ptr<Client> daemon;
  eventually([&] {
    try {
      daemon = std::make_unique<Client>(socket);
      daemon->call("status", {});
      return true;
    } catch (const ProtocolError&) {
      daemon.reset();
      return !emtbd.running();
    }
  });
  return daemon;
}

/// What the daemon tells of the end of the run that is on; null where none comes. The client has subscribed.
inline nlohmann::json end_of_run(Client& daemon) {
  nlohmann::json end;
  eventually([&] {
    const auto message = daemon.notification(1);
    if (message && (*message)["method"] == "ended") end = (*message)["params"];
    return !end.is_null();
  });
  return end;
}

/// Arms the bench and begins a run.
inline void begin_run(Client& daemon, const std::string& profile) {
  daemon.call("reset", {});
  daemon.call("subscribe", {{"rate", 1}});
  daemon.call("run", {{"profile", profile}});
}

/// The same, to its end. @return how it ended
inline nlohmann::json run_to_its_end(Client& daemon, const std::string& profile) {
  begin_run(daemon, profile);
  return end_of_run(daemon);
}

}  // namespace emtb
