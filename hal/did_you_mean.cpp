#include "hal/did_you_mean.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <numeric>

namespace emtb {
namespace {

/// How many letters must be put in, taken out, changed or swapped with their neighbour to make one word of another.
std::size_t typing_errors(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  std::iota(d[0].begin(), d[0].end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

}  // namespace

std::string did_you_mean(std::string_view typed, const std::vector<std::string>& known) {
  constexpr std::size_t longest = 64;  // a word that a person types; more takes its square of time
  if (typed.empty() || typed.size() > longest) return "";
  const auto errors = [&](const std::string& word) { return typing_errors(typed, word); };
  const auto nearest = std::ranges::min_element(known, {}, errors);
  const std::size_t few = std::max<std::size_t>(1, typed.size() / 3);
  if (nearest != known.end() && errors(*nearest) <= std::min(few, typed.size() - 1)) {
    return "; did you mean " + *nearest + "?";
  }
  constexpr std::size_t least = 3, most = 3;  // letters that tell a word; words among which one chooses
  std::vector<std::string> holding;
  std::ranges::copy_if(known, std::back_inserter(holding),
                       [&](const std::string& word) { return word.find(typed) != std::string::npos; });
  if (typed.size() < least || holding.empty() || holding.size() > most) return "";
  std::string guess = "; did you mean " + holding.front();
  for (std::size_t i = 1; i < holding.size(); ++i) guess += (i + 1 < holding.size() ? ", " : " or ") + holding[i];
  return guess + "?";
}

}  // namespace emtb
