#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "tests/blind/answer.h"

namespace emtb::blind {

/// A count out of a number of trials.
struct Share {
  std::size_t count = 0, of = 0;

  double value() const { return of == 0 ? 0 : static_cast<double>(count) / static_cast<double>(of); }
  void add(bool hit) {
    ++of;
    if (hit) ++count;
  }
};

/// The 95 % interval of a share after Wilson (1927): holds for few trials and for shares near 0 and 1.
struct Interval {
  double low = 0, high = 1;
};
Interval wilson(const Share& share);

/// What the judge counts, each against its target.
struct Scores {
  Share single_named, single_alone, healthy_named, pair_both, pair_any, outside_stated, covered, base_covered, in_time;
  Share lacking_stated;             ///< cases about an effect that the library does not have: said so
  Share single_clean;               ///< of those named right: nothing material was left, in the diagnosis's own words
  Share healthy_unknown;            ///< healthy, nothing named, yet a remainder that is not there was claimed
  double final_error = 0;           ///< median over singles that were named right, true sigma
  double seconds = 0, slowest = 0;  ///< median and 95 % quantile of a diagnosis
  double cpu_seconds = 0;           ///< median
  std::size_t failed = 0, not_made = 0;
};
Scores score(std::span<const Answer> answers);

/// A case in a line: id, truth, size, verdict, what was named, held-out error before and after, seconds.
std::string line_of(const Answer& answer);

/// Targets, confusion and misses in Markdown.
/// @param causes of misses, by case: what people found out
std::string tables(std::span<const Answer> answers, const std::map<std::string, std::string>& causes);

/// Puts the tables between the markers of a page; causes that people wrote beside misses stay.
/// @throws Error where the page has no markers, or cannot be written.
void update_page(const std::filesystem::path& page, std::span<const Answer> answers);

}  // namespace emtb::blind
