#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "drivers/serial_meter/measurement.h"

namespace emtb::scpi_meter {

/// Where in a line of answer its number stands: in a field, or where a pattern says.
class Place {
 public:
  /// @param number of the field, the first is 1
  static Place field(std::size_t number, char separator) { return Place(number, separator, {}); }
  /// @param pattern a regular expression as of ECMAScript, without back-references; the number is its first group, or
  /// all that it matches
  /// @return nothing where the pattern cannot be read; `why` says what is wrong with it
  static std::optional<Place> pattern(const std::string& pattern, std::string& why);

  /// The number's text; nothing where the line has none there.
  std::optional<std::string_view> in(std::string_view line) const;

 private:
  struct Pattern;
  Place(std::size_t field, char separator, std::shared_ptr<const Pattern> pattern)
      : field_(field), separator_(separator), pattern_(std::move(pattern)) {}

  std::size_t field_;
  char separator_;
  std::shared_ptr<const Pattern> pattern_;
};

/// A whole text that is one finite number: `+1.23E-03`, blanks around it allowed.
std::optional<double> number_of(std::string_view text) noexcept;

/// How the lines of one meter are told from each other.
struct Answers {
  Place place = Place::field(1, ',');
  double overload = 9e37;     ///< from this size on, of either sign, there is no value: 9.9E+37 by the SCPI standard
  std::string identity = {};  ///< how the answer to *IDN? begins; empty: a letter first, then three commas
  std::string mode = {};      ///< the answer to the question for the mode; empty: it is not asked

  /// Sorts one line: an identity is a prompt, the mode a function, a number a reading, and all else noise.
  serial_meter::Message classify(std::string_view line) const;
};

}  // namespace emtb::scpi_meter
