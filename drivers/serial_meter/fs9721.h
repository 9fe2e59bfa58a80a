#pragma once

#include "drivers/serial_meter/measurement.h"

namespace emtb::serial_meter::fs9721 {

/// The 14 bytes of a Fortune FS9721_LP3: the segments of the meter's display, sent by itself.
///
/// Each byte carries its position, 1 to 14, in the upper four bits, so that no other alignment can be mistaken for a
/// frame, and four segments in the lower ones:
///
///     1     AC DC AUTO RS232
///     2-9   four digits of seven segments, two bytes each; the eighth bit is the minus or the point before the digit
///     10    micro nano kilo diode      11  milli percent mega beep
///     12    farad ohm REL HOLD         13  ampere volt hertz battery
///     14    the maker's own
///
/// Source: libsigrok, src/dmm/fs9721.c, which takes an unknown digit for -1; we refuse it.
inline constexpr std::size_t frame_length = 14;

/// @param frame frame_length bytes; @return nothing for anything that a meter does not send
std::optional<Measurement> parse(std::string_view frame) noexcept;

inline Message find(std::string_view received) noexcept { return find_frame<frame_length>(received, parse); }

}  // namespace emtb::serial_meter::fs9721
