#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "hal/error.h"

namespace emtb::rpc {

/// Who is on the other end of a connection, as the kernel says (SO_PEERCRED).
struct Peer {
  std::uint64_t id = 0;  ///< of the connection, never used twice
  int pid = 0;
  unsigned uid = 0;
  unsigned gid = 0;
};

/// JSON-RPC 2.0's own error codes; those of emtb are >= 1.
namespace code {
inline constexpr int parse_error = -32700;
inline constexpr int invalid_request = -32600;
inline constexpr int method_not_found = -32601;
inline constexpr int invalid_params = -32602;
inline constexpr int internal_error = -32603;
inline constexpr int latched = 1;        ///< the latch holds: `emtb reset` first; data: fault
inline constexpr int busy = 2;           ///< somebody else's run is on; data: who
inline constexpr int bad_profile = 3;    ///< not found, malformed, or beyond the bench's limits
inline constexpr int cannot_record = 4;  ///< the session's file cannot be created
inline constexpr int cause_stands = 5;   ///< reset refused; data: fault
inline constexpr int not_available = 6;  ///< nothing of the kind is there
inline constexpr int not_ready = 7;      ///< a need of the profile is not met; data: need

inline constexpr int superseded = -32000;  ///< of the page: a newer one came, or it was cancelled

/// All of emtb's own, by number.
inline constexpr std::array names{std::pair{latched, "latched"},           std::pair{busy, "busy"},
                                  std::pair{bad_profile, "bad_profile"},   std::pair{cannot_record, "cannot_record"},
                                  std::pair{cause_stands, "cause_stands"}, std::pair{not_available, "not_available"},
                                  std::pair{not_ready, "not_ready"}};
}  // namespace code

/// A method's answer is an error.
class Refusal : public ProtocolError {
 public:
  Refusal(int code, const std::string& message);
  Refusal(int code, const std::string& message, const nlohmann::json& data);

  int code() const noexcept { return code_; }
  const nlohmann::json* data() const noexcept { return data_.get(); }  ///< or nullptr

 private:
  int code_;
  std::shared_ptr<const nlohmann::json> data_;
};

/// The parameters of a request, checked as they are read: what does not fit is a Refusal with code invalid_params.
class Params {
 public:
  explicit Params(const nlohmann::json& object) : object_(object) {}

  void only(std::initializer_list<std::string_view> known) const;
  std::string text(std::string_view key) const;
  std::string text_or(std::string_view key, std::string_view fallback) const;
  bool flag_or(std::string_view key, bool fallback) const;
  double number_or(std::string_view key, double fallback, double min, double max) const;

 private:
  const nlohmann::json* find(std::string_view key) const;
  const nlohmann::json& object_;
};

using Method = std::function<nlohmann::json(const Params&, const Peer&)>;

/// A result that takes its time: asked again and again, without ever waiting; null until it is there. May throw
/// Refusal.
using Later = std::function<nlohmann::json()>;
using SlowMethod = std::function<Later(const Params&, const Peer&)>;

/// What is sent back: at once or by and by.
struct Reply {
  Reply() = default;
  Reply(std::string text) : line(std::move(text)) {}  // NOLINT: a line is a reply

  std::string line;                      ///< without its newline; empty: nothing, as for a notification
  std::function<std::string()> later{};  ///< where set: asked until it gives a line that is not empty
};

/// JSON-RPC 2.0 without a socket: a line in, a line out.
class Methods {
 public:
  void add(std::string name, Method method) { methods_[std::move(name)] = std::move(method); }
  void add_slow(std::string name, SlowMethod method) { methods_[std::move(name)] = std::move(method); }

  /// Answers one line, whatever is in it. Batches are refused: one object a line.
  Reply answer(std::string_view line, const Peer& peer) const noexcept;

 private:
  std::string known() const;

  std::map<std::string, std::variant<Method, SlowMethod>, std::less<>> methods_;
};

/// Whether the beginning of a line, cut anywhere, is that of a request for this method.
bool begins_request(std::string_view line, std::string_view method);

/// A line that is no answer: `{"jsonrpc": "2.0", "method": ..., "params": ...}`.
std::string notification(std::string_view method, const nlohmann::json& params);

/// An object, nothing of it nested deeply: copying a value recurses, and a line of brackets would end the stack.
/// @throws Refusal where the text is no such thing
nlohmann::json parsed_request(std::string_view text);

/// Answers to a request with this id.
std::string answer_result(const nlohmann::json& id, const nlohmann::json& result);
std::string answer_error(const nlohmann::json& id, int code, std::string_view message);

/// The answer to a line that cannot even be read, e.g. a too long one.
std::string error_line(int code, std::string_view message);

}  // namespace emtb::rpc
