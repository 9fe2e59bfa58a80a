#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace emtb {

/// What a person may have meant who typed a word that is none of those known, for the end of a message: the known word
/// that is nearest, where it is a typing error away; else those that hold what was typed, three at most.
/// @return `; did you mean diagnose?`, or nothing where no known word is near
std::string did_you_mean(std::string_view typed, const std::vector<std::string>& known);

}  // namespace emtb
