#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

namespace emtb {

enum class BatchWork { calibrate, compare, diagnose };

/// What a parameter, or `error`, may be; for pass and fail.
struct BatchLimit {
  std::string of;  ///< `K_b`, `coulomb_friction.T_c`, `error`
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
};

/// One motor: what is done once for each.
struct BatchItem {
  std::string serial;                 ///< number or name; unlike all others
  std::string time;                   ///< ISO 8601, as written; empty: what the session says, if it does
  std::vector<std::string> sessions;  ///< PATH[#RUN][@T0:T1]
  std::vector<std::string> held_out;
  std::string model;  ///< file
};

/// What `emtb batch` works on. Paths are relative to the file that names them.
struct Manifest {
  std::filesystem::path file;
  std::string name;
  BatchWork work = BatchWork::calibrate;
  std::string map;  ///< file; empty: none
  bool unchecked = false;
  std::vector<BatchLimit> limits;
  std::vector<BatchItem> items;  ///< in the order of the file; those of `files` by name
};

/// @throws ConfigError with file, line and key.
Manifest read_manifest(const std::filesystem::path& path);

std::string name_of(BatchWork work);

}  // namespace emtb
