#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace emtb {

/// The file of the simulated FH2 bench, with one thing about it changed.
inline std::string fh2_simulated(const std::string& from = "", const std::string& to = "") {
  std::ifstream in(std::filesystem::path(EMTB_CONFIG) / "benches/fh2-simulated.yaml");
  std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

}  // namespace emtb
