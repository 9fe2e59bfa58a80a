#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace emtb {

/// The named signals of a bench, in SI units with the symbols of Erdal et al. (2011).
enum class Signal : std::uint8_t { u_ref, e_a, i_a, omega, theta, torque, i_f, temperature, armature_open };

inline constexpr std::size_t signal_count = 9;

struct SignalInfo {
  std::string_view name;     ///< as in HDF5, JSON and YAML: `i_a`
  std::string_view unit;     ///< SI: `A`
  std::string_view column;   ///< as in CSV: `i_a_A`
  std::string_view meaning;  ///< for people: `armature current`
};

/// All signals, in the order of the enumeration.
const std::array<Signal, signal_count>& all_signals() noexcept;

const SignalInfo& info(Signal signal) noexcept;

/// @return the signal of that name (`i_a`), or nothing.
std::optional<Signal> signal_named(std::string_view name) noexcept;

/// @return the signal of that CSV column (`i_a_A`), or nothing.
std::optional<Signal> signal_of_column(std::string_view column) noexcept;

constexpr std::size_t index(Signal signal) noexcept { return static_cast<std::size_t>(signal); }

}  // namespace emtb
