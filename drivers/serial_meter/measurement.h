#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>

namespace emtb::serial_meter {

/// What a meter says it measures.
enum class Quantity : std::uint8_t {
  unsaid,  ///< the message does not tell
  voltage,
  current,
  resistance,
  frequency,
  capacitance,
  temperature,
  diode,
  continuity,
  ratio,
  other,  ///< decibels, watts, h_FE, ...
};

enum class Coupling : std::uint8_t { unsaid, dc, ac, ac_and_dc };

/// One reading as a meter sends it.
struct Measurement {
  double value = 0;  ///< V, A, ohm, Hz, F, degC, or a fraction; nothing where `overload`
  double digit = 0;  ///< weight of the last digit, in the unit of the value; 0: the message does not tell
  Quantity quantity = Quantity::unsaid;
  Coupling coupling = Coupling::unsaid;
  bool overload = false;  ///< the range is exceeded: there is no value
  bool altered = false;   ///< held, relative, a minimum or a maximum: not what the leads see now
};

/// What a bench file asks a meter for.
struct Function {
  std::string_view name;  ///< as in the bench file: `dc_current`
  Quantity quantity;
  Coupling coupling;      ///< unsaid: either will do
  std::string_view unit;  ///< of the measurement

  /// The measurement is of this function, and is what the leads see now.
  constexpr bool is_of(const Measurement& m) const noexcept {
    return m.quantity == quantity && (coupling == Coupling::unsaid || m.coupling == coupling) && !m.altered;
  }
};

/// What was found at the beginning of received bytes.
struct Message {
  enum class Kind : std::uint8_t {
    partial,   ///< nothing yet: more bytes may make it something
    noise,     ///< `length` bytes that no message can begin with
    reading,   ///< a measurement; its function too where the protocol tells
    function,  ///< which function is set
    prompt,    ///< the command before is done
    refusal,   ///< the command before was not understood
  };

  Kind kind = Kind::partial;
  std::size_t length = 0;  ///< bytes to take away
  Measurement measurement{};
};

/// Finds out what the received bytes begin with. Pure: the same bytes give the same message.
using Find = std::function<Message(std::string_view received)>;

/// Find for frames of one length that carry one measurement each and tell themselves where they begin.
template <std::size_t length>
Message find_frame(std::string_view received,
                   std::optional<Measurement> (*parse)(std::string_view frame) noexcept) noexcept {
  if (received.size() < length) return {};
  if (const auto measurement = parse(received.substr(0, length))) {
    return {.kind = Message::Kind::reading, .length = length, .measurement = *measurement};
  }
  return {.kind = Message::Kind::noise, .length = 1};
}

/// Find for frames of one length and one last byte. One that is longer or shorter has lost a byte or caught one, and is
/// noise as a whole: aligned to its end, it might still read as a number.
template <std::size_t length>
Message find_frame_ending(std::string_view received, char last,
                          std::optional<Measurement> (*parse)(std::string_view frame) noexcept) noexcept {
  const std::size_t end = received.find(last);
  if (end == std::string_view::npos) {
    if (received.size() < 4 * length) return {};
    return {.kind = Message::Kind::noise, .length = received.size()};
  }
  if (end + 1 == length) {
    if (const auto measurement = parse(received.substr(0, length))) {
      return {.kind = Message::Kind::reading, .length = length, .measurement = *measurement};
    }
  }
  return {.kind = Message::Kind::noise, .length = end + 1};
}

inline constexpr std::size_t longest_line = 80;  ///< [bytes] of an answer; what is longer is noise

/// Find for lines of text that end with CR, LF or both.
template <class Classify>
Message find_line(std::string_view received, const Classify& classify) {
  const std::size_t end = received.find_first_of("\r\n");
  if (end == 0) return {.kind = Message::Kind::noise, .length = 1};
  if (end == std::string_view::npos) {
    return received.size() > longest_line ? Message{.kind = Message::Kind::noise, .length = received.size()}
                                          : Message{};
  }
  Message message = end > longest_line ? Message{.kind = Message::Kind::noise} : classify(received.substr(0, end));
  message.length = end + 1;
  return message;
}

}  // namespace emtb::serial_meter
