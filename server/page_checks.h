#pragma once

#include <string>
#include <string_view>

namespace emtb {

/// Who may ask the page's server for anything. A browser sends whatever a hostile site makes it send, but it says
/// truly from where (`Origin`) and whom it believes to ask (`Host`).

/// Is it this computer that was meant: `localhost`, `127.0.0.1` or `[::1]` at any port, or the address listened at?
/// Another name may be one that a hostile server has just pointed here (DNS rebinding).
/// @param listen the address of `--listen`; empty: none
bool host_allowed(std::string_view host, std::string_view listen);

/// Is it a page of ours that asks: `http://HOST` or `https://HOST`, the same host and port?
bool origin_matches(std::string_view origin, std::string_view host);

/// The same, taking as long wherever they differ.
bool same_token(std::string_view given, std::string_view token);

/// 128 random bits in hex. @throws Error where the kernel gives none
std::string random_token();

}  // namespace emtb
