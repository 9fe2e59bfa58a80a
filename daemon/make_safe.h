#pragma once

#include <filesystem>

#include "config/bench.h"

namespace emtb {

/// What `emtbd --safe` and `emtb-safe` do: opens the reference of that bench alone, drives it to its safe value, ends.
/// Says on standard error why, where it could not.
/// @param program who says so
/// @return the exit status: 0 done, 1 the reference may not be safe, 2 the bench file cannot be read
int make_safe(const std::filesystem::path& bench, const char* program) noexcept;

/// The same of a bench that has been read. @param program null: says nothing
int make_safe(const BenchConfig& config, const char* program) noexcept;

}  // namespace emtb
