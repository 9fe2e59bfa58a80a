#include "drivers/modbus_meter/value.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace emtb::modbus_meter {

std::optional<Type> type_named(std::string_view name) noexcept {
  constexpr std::array<std::pair<std::string_view, Type>, 5> types{
      {{"u16", Type::u16}, {"s16", Type::s16}, {"u32", Type::u32}, {"s32", Type::s32}, {"f32", Type::f32}}};
  const auto found = std::ranges::find(types, name, &std::pair<std::string_view, Type>::first);
  return found == types.end() ? std::nullopt : std::optional{found->second};
}

std::optional<Order> order_named(std::string_view name) noexcept {
  for (const std::string_view known : {"ABCD", "CDAB", "BADC", "DCBA"}) {
    if (name != known) continue;
    Order order;
    for (std::size_t k = 0; k < known.size(); ++k) order.rank[k] = static_cast<std::uint8_t>(known[k] - 'A');
    return order;
  }
  return std::nullopt;
}

double decode(std::span<const std::uint16_t> words, Type type, Order order) noexcept {
  const std::size_t bytes = 2 * words.size();
  std::uint32_t bits = 0;
  for (std::size_t k = 0; k < bytes; ++k) {
    const std::uint32_t byte = k % 2 == 0 ? words[k / 2] >> 8U : words[k / 2] & 0xffU;
    // Of one register only the order within it matters: A before B, or B before A.
    const std::size_t rank = bytes == 2 ? order.rank[k] % 2U : order.rank[k];
    bits |= byte << (8U * (bytes - 1 - rank));
  }
  switch (type) {
    case Type::u16:
    case Type::u32:
      return bits;
    case Type::s16:
      return static_cast<std::int16_t>(bits);
    case Type::s32:
      return static_cast<std::int32_t>(bits);
    case Type::f32:
      return static_cast<double>(std::bit_cast<float>(bits));
  }
  return 0;
}

}  // namespace emtb::modbus_meter
