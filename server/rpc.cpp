#include "server/rpc.h"

#include <cmath>
#include <exception>
#include <nlohmann/json.hpp>

namespace emtb::rpc {
namespace {

using nlohmann::json;

/// Never throws for odd bytes: what is not UTF-8 is replaced.
std::string dump(const json& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); }

/// Parses, but nothing deep: copying a value recurses, and a line of brackets would end the stack and with it the
/// daemon.
json parse(std::string_view line) {
  constexpr int deepest = 16;
  return json::parse(line, [](int depth, json::parse_event_t, const json&) {
    if (depth > deepest) throw ProtocolError("nested too deeply");
    return true;
  });
}

std::string result(const json& id, json value) {
  return dump({{"jsonrpc", "2.0"}, {"id", id}, {"result", std::move(value)}});
}

std::string failure(const json& id, int code, std::string_view message, const json* data = nullptr) {
  json error = {{"code", code}, {"message", message}};
  if (data != nullptr) error["data"] = *data;
  return dump({{"jsonrpc", "2.0"}, {"id", id}, {"error", std::move(error)}});
}

/// What is wrong with a request by JSON-RPC's own rules; empty: nothing.
std::string complaint(const json& request) {
  if (!request.is_object()) return "a request must be an object, one a line";
  const auto version = request.find("jsonrpc");
  if (version == request.end() || *version != "2.0") return "jsonrpc must be \"2.0\"";
  const auto method = request.find("method");
  if (method == request.end() || !method->is_string()) return "method must be a text";
  if (const auto id = request.find("id");
      id != request.end() && !id->is_string() && !id->is_number() && !id->is_null()) {
    return "id must be a text, a number or null";
  }
  if (const auto params = request.find("params");
      params != request.end() && !params->is_object() && !params->is_array()) {
    return "params must be an object";
  }
  for (const auto& [key, value] : request.items()) {
    if (key != "jsonrpc" && key != "method" && key != "id" && key != "params") return "unknown member " + key;
  }
  return {};
}

}  // namespace

Refusal::Refusal(int code, const std::string& message) : ProtocolError(message), code_(code) {}

Refusal::Refusal(int code, const std::string& message, const json& data)
    : ProtocolError(message), code_(code), data_(std::make_shared<json>(data)) {}

const json* Params::find(std::string_view key) const {
  const auto found = object_.find(key);
  return found == object_.end() ? nullptr : &*found;
}

void Params::only(std::initializer_list<std::string_view> known) const {
  for (const auto& [key, value] : object_.items()) {
    if (std::ranges::find(known, key) != known.end()) continue;
    std::string list;
    for (const auto name : known) list += (list.empty() ? "" : ", ") + std::string(name);
    throw Refusal(code::invalid_params, key + " is not known here. Known: " + (list.empty() ? "none" : list));
  }
}

std::string Params::text(std::string_view key) const {
  const json* value = find(key);
  if (value == nullptr) throw Refusal(code::invalid_params, std::string(key) + " is missing");
  if (!value->is_string()) throw Refusal(code::invalid_params, std::string(key) + " must be a text");
  return value->get<std::string>();
}

std::string Params::text_or(std::string_view key, std::string_view fallback) const {
  return find(key) == nullptr ? std::string(fallback) : text(key);
}

bool Params::flag_or(std::string_view key, bool fallback) const {
  const json* value = find(key);
  if (value == nullptr) return fallback;
  if (!value->is_boolean()) {
    throw Refusal(code::invalid_params, "`" + std::string(key) + "` is not true or false: " + value->dump());
  }
  return value->get<bool>();
}

double Params::number_or(std::string_view key, double fallback, double min, double max) const {
  const json* value = find(key);
  if (value == nullptr) return fallback;
  const double number = value->is_number() ? value->get<double>() : std::nan("");
  if (!(number >= min && number <= max)) {
    throw Refusal(code::invalid_params,
                  std::string(key) + " must be a number from " + json(min).dump() + " to " + json(max).dump());
  }
  return number;
}

std::string Methods::known() const {
  std::string list;
  for (const auto& [name, method] : methods_) list += (list.empty() ? ". Known: " : ", ") + name;
  return list;
}

std::string Methods::answer(std::string_view line, const Peer& peer) const noexcept {
  try {
    json request;
    try {
      request = parse(line);
    } catch (const std::exception&) {
      return failure(nullptr, code::parse_error, "not JSON, or nested too deeply: one object a line is wanted");
    }
    if (const std::string wrong = complaint(request); !wrong.empty()) {
      return failure(nullptr, code::invalid_request, wrong);
    }
    const bool wants_answer = request.contains("id");
    const json id = request.value("id", json());
    const std::string& name = request["method"].get_ref<const std::string&>();
    const json params = request.value("params", json::object());
    std::string answer;
    try {
      const auto method = methods_.find(name);
      if (method == methods_.end()) throw Refusal(code::method_not_found, "there is no method " + name + known());
      if (params.is_array() && !params.empty()) throw Refusal(code::invalid_params, "params must be named, not a list");
      const json none = json::object();
      answer = result(id, method->second(Params(params.is_array() ? none : params), peer));
    } catch (const Refusal& refusal) {
      answer = failure(id, refusal.code(), refusal.what(), refusal.data());
    } catch (const std::exception& e) {
      answer = failure(id, code::internal_error, e.what());
    }
    return wants_answer ? answer : std::string();
  } catch (const std::exception&) {  // out of memory
    return R"({"jsonrpc":"2.0","id":null,"error":{"code":-32603,"message":"internal error"}})";
  }
}

std::string notification(std::string_view method, const json& params) {
  return dump({{"jsonrpc", "2.0"}, {"method", method}, {"params", params}});
}

std::string error_line(int code, std::string_view message) { return failure(nullptr, code, message); }

}  // namespace emtb::rpc
