#pragma once

#include "drivers/serial_meter/measurement.h"

namespace emtb::serial_meter::metex {

/// The 14-byte ASCII frame of Metex and its relatives, the answer to one byte `D`.
///
///     DC 1.2345   V<CR>
///
/// Two characters function, seven of a number or `OL`, four of a unit, CR. No checksum: function, number and unit must
/// each be one that the meters have, and must agree.
/// Source: libsigrok, src/dmm/metex14.c, which does not look at the digits; we do.
inline constexpr std::size_t frame_length = 14;

/// @param frame frame_length bytes; @return nothing for anything that a meter does not send
std::optional<Measurement> parse(std::string_view frame) noexcept;

inline Message find(std::string_view received) noexcept {
  return find_frame_ending<frame_length>(received, '\r', parse);
}

}  // namespace emtb::serial_meter::metex
