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

/// What somebody sent, short enough to be sent back.
std::string shown(const std::string& text) {
  constexpr std::size_t longest = 60;
  return text.size() <= longest ? text : text.substr(0, longest) + "...";
}

/// The line that `work` gives, or the one that says why not.
template <class Work>
std::string or_failure(const json& id, Work work) {
  try {
    return work();
  } catch (const Refusal& refusal) {
    return failure(id, refusal.code(), refusal.what(), refusal.data());
  } catch (const std::exception& e) {
    return failure(id, code::internal_error, e.what());
  }
}

/// Looks for the member `method` of a request, and no further.
class MethodFinder : public nlohmann::json_sax<json> {
 public:
  explicit MethodFinder(std::string_view wanted) : wanted_(wanted) {}
  bool found() const { return found_; }

  bool null() override { return other(); }
  bool boolean(bool) override { return other(); }
  bool number_integer(number_integer_t) override { return other(); }
  bool number_unsigned(number_unsigned_t) override { return other(); }
  bool number_float(number_float_t, const string_t&) override { return other(); }
  bool binary(binary_t&) override { return other(); }
  bool string(string_t& text) override {
    if (!is_method_) return true;
    found_ = text == wanted_;
    return false;
  }
  bool start_object(std::size_t) override { return ++depth_ <= deepest && other(); }
  bool start_array(std::size_t) override { return ++depth_ <= deepest && other(); }
  bool end_object() override { return --depth_ > 0; }
  bool end_array() override { return --depth_ > 0; }
  bool key(string_t& name) override {
    is_method_ = depth_ == 1 && name == "method";
    return true;
  }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override { return false; }

 private:
  static constexpr int deepest = 16;
  bool other() const { return !is_method_; }

  std::string_view wanted_;
  int depth_ = 0;
  bool is_method_ = false;
  bool found_ = false;
};

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
    if (key != "jsonrpc" && key != "method" && key != "id" && key != "params") return "unknown member " + shown(key);
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
    throw Refusal(code::invalid_params, shown(key) + " is not known here. Known: " + (list.empty() ? "none" : list));
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

Reply Methods::answer(std::string_view line, const Peer& peer) const noexcept {
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
    Reply reply;
    const std::string now = or_failure(id, [&] {
      const auto found = methods_.find(name);
      if (found == methods_.end()) throw Refusal(code::method_not_found, "there is no method " + shown(name) + known());
      if (params.is_array() && !params.empty()) throw Refusal(code::invalid_params, "params must be named, not a list");
      const json none = json::object();
      const Params named(params.is_array() ? none : params);
      if (const auto* at_once = std::get_if<Method>(&found->second)) return result(id, (*at_once)(named, peer));
      reply.later = [id, later = std::get<SlowMethod>(found->second)(named, peer)] {
        return or_failure(id, [&] {
          json there = later();
          return there.is_null() ? std::string() : result(id, std::move(there));
        });
      };
      return std::string();
    });
    if (!wants_answer) return {};
    reply.line = now;
    return reply;
  } catch (const std::exception&) {  // out of memory
    return std::string(
        R"({"jsonrpc":"2.0","id":null,"error":{"code":-32603,"message":"the memory that is free is not enough"}})");
  }
}

bool begins_request(std::string_view line, std::string_view method) {
  MethodFinder finder(method);
  json::sax_parse(line, &finder);
  return finder.found();
}

std::string notification(std::string_view method, const json& params) {
  return dump({{"jsonrpc", "2.0"}, {"method", method}, {"params", params}});
}

json parsed_request(std::string_view text) {
  json request;
  try {
    request = parse(text);
  } catch (const std::exception& e) {
    throw Refusal(code::parse_error, std::string("no JSON: ") + e.what());
  }
  if (!request.is_object() || !request.contains("method") || !request["method"].is_string()) {
    throw Refusal(code::invalid_request, "a request is an object with a `method`");
  }
  if (!request.contains("params") || request["params"].is_null()) request["params"] = json::object();
  if (!request["params"].is_object()) throw Refusal(code::invalid_params, "`params` is an object");
  return request;
}

std::string answer_result(const json& id, const json& value) { return result(id, value); }

std::string answer_error(const json& id, int number, std::string_view message) { return failure(id, number, message); }

std::string error_line(int code, std::string_view message) { return failure(nullptr, code, message); }

}  // namespace emtb::rpc
