#pragma once

#include <optional>
#include <string_view>

namespace emtb {

/// A file of the page, as it was when the program was built.
struct WebAsset {
  std::string_view bytes;
  std::string_view type;  ///< for Content-Type
};

/// The file that a browser asks for by this path: `/`, `/page.js`, `/page.css`; none: not found.
std::optional<WebAsset> web_asset(std::string_view path);

}  // namespace emtb
