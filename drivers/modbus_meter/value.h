#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace emtb::modbus_meter {

/// How a number lies in registers of 16 bits.
enum class Type : std::uint8_t { u16, s16, u32, s32, f32 };

/// @return the type of that name (`f32`), or nothing
std::optional<Type> type_named(std::string_view name) noexcept;

/// Registers that a number of the type takes: 1 or 2.
constexpr int words_of(Type type) noexcept { return type == Type::u16 || type == Type::s16 ? 1 : 2; }

/// In which order the bytes of a number come: A is its highest. `ABCD` as Modbus says, `CDAB` where the registers are
/// swapped, `BADC` where the bytes within are, `DCBA` both.
struct Order {
  std::array<std::uint8_t, 4> rank{0, 1, 2, 3};  ///< of each byte as it comes: 0 is the highest
};

std::optional<Order> order_named(std::string_view name) noexcept;

/// The number that lies in the registers.
/// @param words words_of(type) registers, in the order of their addresses
double decode(std::span<const std::uint16_t> words, Type type, Order order) noexcept;

}  // namespace emtb::modbus_meter
