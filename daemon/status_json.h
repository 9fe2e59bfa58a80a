#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "daemon/lateness.h"
#include "daemon/loop.h"
#include "server/rpc.h"

namespace emtb {

/// `done`, `stopped`, `fault`: how a run ended.
std::string_view word(Outcome outcome);

/// null for none; else code, name and the text given.
nlohmann::json fault_json(Fault fault, const std::string& what);

/// The user's login, or the number where nobody has it.
std::string user_name(unsigned uid);

/// pid, uid, gid and login of a client.
nlohmann::json who(const rpc::Peer& peer);

/// [us] p50, p99, p999 and the largest.
nlohmann::json percentiles(const Durations& durations);

/// `[[8, 120], [9, 3]]`: 120 times up to 8 us, three times up to 9; bins in which there is something.
nlohmann::json histogram(const Durations& durations);

/// The percentiles as a line for people.
std::string percentiles_text(const char* what, const Durations& durations);

}  // namespace emtb
