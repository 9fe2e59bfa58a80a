#pragma once

#include <string>
#include <string_view>

namespace emtb {

/// Text as XML and HTML hold it; control characters, which they cannot hold, are left out.
std::string escaped(std::string_view text);

}  // namespace emtb
