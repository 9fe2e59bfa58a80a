#pragma once

#include "drivers/serial_meter/measurement.h"

namespace emtb::serial_meter::es51922 {

/// The 14 bytes of a Cyrustek ES51922, sent by itself (19200 baud, 7 bits, odd parity):
///
///     1 range  5 digits  1 function  1 status  4 options  CR LF
///
/// The digits carry no point: function and range say where it is. All but CR and LF have 3 as their upper four bits. No
/// checksum but the parity of each byte: range, digits and function must each be one that the meter has, and must
/// agree.
/// Source: libsigrok, src/dmm/es519xx.c; ranges as in the ES51922 data sheet.
inline constexpr std::size_t frame_length = 14;

/// @param frame frame_length bytes; @return nothing for anything that a meter does not send
std::optional<Measurement> parse(std::string_view frame) noexcept;

inline Message find(std::string_view received) noexcept {
  return find_frame_ending<frame_length>(received, '\n', parse);
}

}  // namespace emtb::serial_meter::es51922
