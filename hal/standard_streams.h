#pragma once

namespace emtb {

/// Standard input, output and error are open: /dev/null where they were not. A device or a socket must not become one
/// of them, or it is sent the log.
void have_standard_streams() noexcept;

}  // namespace emtb
