#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "hal/fault.h"
#include "hal/signal.h"

namespace emtb::program {

/// What host and program say to each other (docs/wiring/program.md), a line each.

inline constexpr int protocol_version = 1;

/// `emtb 1 NAME`: the first line of a program, once it measures and its output is safe.
struct Hello {
  int version = 0;
  std::string name;
};

struct Value {
  Signal signal{};
  double value = 0;  ///< the program's number, before scale and offset; may be NaN or infinite
};

/// `i_a=1.25 omega=80.1 t=5321.3`, in any order; each word once.
struct Report {
  std::array<Value, signal_count> values{};
  std::size_t count = 0;
  std::optional<double> time;  ///< [s] on CLOCK_MONOTONIC; absent: the line's arrival
  std::optional<double> out;   ///< [V] at its output
};

std::optional<Hello> read_hello(std::string_view line);

/// @return nothing for any other line
std::optional<Report> read_report(std::string_view line) noexcept;

/// `fault over_range`: of those that a program may name. @return nothing for any other line
std::optional<Fault> read_fault(std::string_view line) noexcept;

inline constexpr std::string_view greeting = "emtb 1\n";

/// `set 1.25`. @param volts finite
std::string set_line(double volts);

}  // namespace emtb::program
