#include "server/page_checks.h"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>

#include "hal/error.h"

namespace emtb {
namespace {

std::string lower(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

/// Without its port; empty where what stands behind the name is none.
std::string name_of_host(std::string_view host) {
  const bool bracket = host.starts_with('[');
  const std::size_t end = bracket ? host.find(']') : host.find(':');
  if (bracket && end == std::string_view::npos) return {};
  const std::size_t length = end == std::string_view::npos ? host.size() : end + (bracket ? 1 : 0);
  const std::string_view rest = host.substr(length);
  const bool port =
      rest.empty() || (rest.size() > 1 && rest.size() <= 6 && rest.front() == ':' &&
                       std::ranges::all_of(rest.substr(1), [](unsigned char c) { return std::isdigit(c); }));
  return port ? lower(host.substr(0, length)) : std::string();
}

}  // namespace

bool host_allowed(std::string_view host, std::string_view listen) {
  const std::string name = name_of_host(host);
  if (name == "localhost" || name == "127.0.0.1" || name == "[::1]") return true;
  if (listen.empty()) return false;
  const std::string other = lower(listen);
  return name == other || name == "[" + other + "]";
}

bool origin_matches(std::string_view origin, std::string_view host) {
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (origin.starts_with(scheme) && lower(origin.substr(scheme.size())) == lower(host)) return !host.empty();
  }
  return false;
}

bool same_token(std::string_view given, std::string_view token) {
  if (given.size() != token.size() || token.empty()) return false;
  unsigned different = 0;
  for (std::size_t i = 0; i < token.size(); ++i) different |= static_cast<unsigned>(given[i] ^ token[i]);
  return different == 0;
}

std::string random_token() {
  std::array<std::uint8_t, 16> bits{};
  if (getrandom(bits.data(), bits.size(), 0) != static_cast<ssize_t>(bits.size())) {
    throw Error("the kernel gives no random bits for the page's token");
  }
  std::string text;
  for (const std::uint8_t byte : bits) {
    text += "0123456789abcdef"[byte >> 4];
    text += "0123456789abcdef"[byte & 15];
  }
  return text;
}

}  // namespace emtb
