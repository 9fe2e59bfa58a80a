#include <array>
#include <cstdint>

#include "export/fmu.h"

namespace emtb {
namespace {

std::uint32_t crc32(const std::string& data) {
  static const auto table = [] {
    std::array<std::uint32_t, 256> entries{};
    for (std::uint32_t n = 0; n < entries.size(); ++n) {
      std::uint32_t c = n;
      for (int bit = 0; bit < 8; ++bit) c = (c & 1U) != 0 ? 0xEDB88320U ^ (c >> 1) : c >> 1;
      entries[n] = c;
    }
    return entries;
  }();
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const char c : data) crc = table[(crc ^ static_cast<unsigned char>(c)) & 0xFFU] ^ (crc >> 8);
  return crc ^ 0xFFFFFFFFU;
}

/// Little-endian numbers behind one another.
class Bytes {
 public:
  Bytes& u16(std::uint32_t value) { return number(value, 2); }
  Bytes& u32(std::uint32_t value) { return number(value, 4); }
  std::string text;

 private:
  Bytes& number(std::uint32_t value, int bytes) {
    for (int k = 0; k < bytes; ++k) text += static_cast<char>(value >> (8 * k) & 0xFFU);
    return *this;
  }
};

/// What the head of a file and its entry in the directory have in common: stored, of the first day that a zip knows.
std::string described(const std::string& name, const std::string& data) {
  constexpr std::uint32_t version = 10, stored = 0, midnight = 0, first_day = (0U << 9) | (1U << 5) | 1U;
  const auto size = static_cast<std::uint32_t>(data.size());
  Bytes out;
  out.u16(version).u16(0).u16(stored).u16(midnight).u16(first_day).u32(crc32(data)).u32(size).u32(size);
  out.u16(static_cast<std::uint32_t>(name.size())).u16(0);
  return out.text;
}

}  // namespace

std::string zip_archive(const std::vector<std::pair<std::string, std::string>>& files) {
  constexpr std::uint32_t file_head = 0x04034b50, directory_entry = 0x02014b50, end = 0x06054b50;
  std::string archive, directory;
  for (const auto& [name, data] : files) {
    const std::string about = described(name, data);
    Bytes entry;
    entry.u32(directory_entry).u16(10);
    entry.text += about;
    entry.u16(0).u16(0).u16(0).u32(0).u32(static_cast<std::uint32_t>(archive.size()));
    directory += entry.text + name;
    archive += Bytes().u32(file_head).text + about + name + data;
  }
  const auto count = static_cast<std::uint32_t>(files.size());
  Bytes tail;
  tail.u32(end).u16(0).u16(0).u16(count).u16(count);
  tail.u32(static_cast<std::uint32_t>(directory.size())).u32(static_cast<std::uint32_t>(archive.size())).u16(0);
  return archive + directory + tail.text;
}

}  // namespace emtb
