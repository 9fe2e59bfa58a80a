#pragma once

#include <array>
#include <string>
#include <string_view>

namespace emtb::serial_meter {

/// What meters put on the line, written from their data sheets and from nothing of ours.

/// `DC`, ` 1.2345`, `V`
inline std::string metex_frame(const std::string& function, const std::string& number, const std::string& unit) {
  const auto padded = [](const std::string& text, std::size_t width) {
    return std::string(width - text.size(), ' ') + text;
  };
  return padded(function, 2) + padded(number, 7) + padded(unit, 4) + "\r";
}

/// An ES51922: range and function as their bytes, digits as five characters, bits of the four option bytes and of the
/// status byte.
inline std::string es51922_frame(char range, const std::string& digits, char function, int status = 0, int option1 = 0,
                                 int option2 = 0, int option3 = 0b1000, int option4 = 0) {
  const auto byte = [](int bits) { return std::string(1, static_cast<char>(0x30 | bits)); };
  return std::string(1, range) + digits + std::string(1, function) + byte(status) + byte(option1) + byte(option2) +
         byte(option3) + byte(option4) + "\r\n";
}

/// The letters of an LCD: segments as `aefbcgd`-coded by the FS9721.
inline unsigned lcd(char shown) {
  switch (shown) {
    case '0':
      return 0x7d;
    case '1':
      return 0x05;
    case '2':
      return 0x5b;
    case '3':
      return 0x1f;
    case '4':
      return 0x27;
    case '5':
      return 0x3e;
    case '6':
      return 0x7e;
    case '7':
      return 0x15;
    case '8':
      return 0x7f;
    case '9':
      return 0x3f;
    case 'L':
      return 0x68;
    default:
      return 0;
  }
}

/// An FS9721 that shows a text (`-1.234`, ` 0L `): four characters, a point before the second, third or fourth, a
/// minus; then its lower half bytes 1 and 10 to 14.
inline std::string fs9721_frame(std::string_view text, unsigned coupling, unsigned b10, unsigned b11, unsigned b12,
                                unsigned b13, unsigned b14 = 0) {
  std::array<unsigned, 14> half{};
  half[0] = coupling;
  std::size_t digit = 0;
  bool point = false;
  for (const char c : text) {
    if (c == '-') {
      half[1] |= 8U;
    } else if (c == '.') {
      point = true;
    } else {
      half[1 + 2 * digit] |= lcd(c) >> 4U | (point ? 8U : 0U);
      half[2 + 2 * digit] = lcd(c) & 0xfU;
      point = false;
      ++digit;
    }
  }
  half[9] = b10;
  half[10] = b11;
  half[11] = b12;
  half[12] = b13;
  half[13] = b14;
  std::string frame;
  for (std::size_t k = 0; k < half.size(); ++k) frame += static_cast<char>((k + 1) << 4U | half[k]);
  return frame;
}

}  // namespace emtb::serial_meter
