#include "drivers/modbus_meter/value.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>

namespace emtb::modbus_meter {
namespace {

/// EMTB_FUZZED_FRAMES=10000000 for a long look.
int fuzzed_values() {
  const char* wish = std::getenv("EMTB_FUZZED_FRAMES");
  return wish != nullptr ? std::atoi(wish) : 200'000;
}

/// Two registers as a meter sends a number of 32 bits: A is its highest byte.
std::array<std::uint16_t, 2> sent(std::uint32_t bits, const std::string& order) {
  std::array<std::uint16_t, 2> words{};
  for (std::size_t k = 0; k < 4; ++k) {
    const auto byte = static_cast<std::uint16_t>(bits >> 8U * static_cast<unsigned>('D' - order[k]) & 0xFFU);
    words[k / 2] = static_cast<std::uint16_t>(words[k / 2] | (k % 2 == 0 ? byte << 8U : byte));
  }
  return words;
}

TEST(ModbusValue, OfFuzzedRegistersIsWhatTheBytesSay) {
  std::mt19937 random(5020);
  const std::array<std::string, 4> orders{"ABCD", "CDAB", "BADC", "DCBA"};
  const int wanted = fuzzed_values();
  for (int n = 0; n < wanted; ++n) {
    const std::uint32_t bits = random();
    const std::string& order = orders[random() % orders.size()];
    const Order rank = order_named(order).value();
    const std::array<std::uint16_t, 2> words = sent(bits, order);
    ASSERT_EQ(decode(words, Type::u32, rank), static_cast<double>(bits));
    ASSERT_EQ(decode(words, Type::s32, rank), static_cast<double>(static_cast<std::int32_t>(bits)));
    const auto real = static_cast<double>(std::bit_cast<float>(bits));
    const double read = decode(words, Type::f32, rank);
    ASSERT_TRUE(read == real || (std::isnan(read) && std::isnan(real))) << bits << " " << order;
    const std::uint32_t low = bits & 0xFFFFU;
    const bool swapped = order == "BADC" || order == "DCBA";  // a number of one register has no order of registers
    const std::array word{static_cast<std::uint16_t>(swapped ? (low << 8U | low >> 8U) & 0xFFFFU : low)};
    ASSERT_EQ(decode(word, Type::u16, rank), static_cast<double>(low)) << order;
    ASSERT_EQ(decode(word, Type::s16, rank), static_cast<double>(static_cast<std::int16_t>(low))) << order;
  }
}

TEST(ModbusValue, NamesThatAreNoneAreRefused) {
  std::mt19937 random(7);
  for (int n = 0; n < 100'000; ++n) {
    std::string name(random() % 6, ' ');
    for (char& c : name) c = static_cast<char>(random() % 4 == 0 ? random() : 'A' + random() % 4);
    const bool known = name == "ABCD" || name == "CDAB" || name == "BADC" || name == "DCBA";
    ASSERT_EQ(order_named(name).has_value(), known) << name;
    ASSERT_FALSE(type_named(name)) << name;
  }
}

}  // namespace
}  // namespace emtb::modbus_meter
