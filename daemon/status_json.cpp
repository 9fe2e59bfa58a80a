#include "daemon/status_json.h"

#include <pwd.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace emtb {

using nlohmann::json;

std::string_view word(Outcome outcome) {
  constexpr std::array<std::string_view, 3> words{"done", "stopped", "fault"};
  return words[static_cast<std::size_t>(outcome)];
}

json fault_json(Fault fault, const std::string& what) {
  if (fault == Fault::none) return nullptr;
  const std::string_view words = text(fault);
  return {{"code", static_cast<int>(fault)}, {"name", words.substr(0, words.find(':'))}, {"text", what}};
}

std::string user_name(unsigned uid) {
  std::array<char, 4096> buffer{};
  passwd entry{};
  passwd* found = nullptr;
  getpwuid_r(uid, &entry, buffer.data(), buffer.size(), &found);
  return found != nullptr ? found->pw_name : std::to_string(uid);
}

json who(const rpc::Peer& peer) {
  return {{"pid", peer.pid}, {"uid", peer.uid}, {"gid", peer.gid}, {"user", user_name(peer.uid)}};
}

json percentiles(const Durations& durations) {
  return {{"p50", durations.percentile(0.5) * 1e6},
          {"p99", durations.percentile(0.99) * 1e6},
          {"p999", durations.percentile(0.999) * 1e6},
          {"max", durations.max * 1e6}};
}

json histogram(const Durations& durations) {
  json bins = json::array();
  for (std::size_t i = 0; i < Durations::bins; ++i) {
    if (durations.count[i] > 0) bins.push_back({std::llround(Durations::upper_edge(i) * 1e6), durations.count[i]});
  }
  return bins;
}

std::string percentiles_text(const char* what, const Durations& durations) {
  std::array<char, 120> words{};
  std::snprintf(words.data(), words.size(), "%s %.0f us (50 %%), %.0f (99 %%), %.0f (99.9 %%), %.0f at most", what,
                durations.percentile(0.5) * 1e6, durations.percentile(0.99) * 1e6, durations.percentile(0.999) * 1e6,
                durations.max * 1e6);
  return words.data();
}

}  // namespace emtb
