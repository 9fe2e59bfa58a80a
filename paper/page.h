#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "figures/figure.h"
#include "paper/experiments.h"

namespace emtb::paper {

/// The page (Markdown), every number from the findings. Pictures are linked as pictures/paper/NAME.svg.
std::string page(const Findings& findings);

/// The pictures by their names, without ending.
std::vector<std::pair<std::string, Figure>> pictures(const Findings& findings);

/// Writes FOLDER/paper.md and FOLDER/pictures/paper/NAME.svg. The same findings give the same bytes.
/// @throws Error where a file cannot be written.
void write_page(const Findings& findings, const std::filesystem::path& folder);

/// Writes the runs behind the figures as sessions, for `emtb estimate`.
/// @return the files
std::vector<std::filesystem::path> write_sessions(const Findings& findings, const std::filesystem::path& folder);

}  // namespace emtb::paper
