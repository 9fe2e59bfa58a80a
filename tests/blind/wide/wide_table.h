#pragma once

#include <span>
#include <string>

#include "tests/blind/table.h"
#include "tests/blind/wide/wide_answer.h"

namespace emtb::blind::wide {

/// The rows of the table, each a share.
struct WideScores {
  Share single, pair, triple;  ///< all named, nothing wrong beside; undecidable cases are left out
  Share healthy_named, healthy_unknown;
  Share single_remainder;  ///< of the singles named right: a remainder is stated that is not there
  Share outside_wrong;     ///< a wrong name, and no word of a remainder
  Share outside_silent;    ///< nothing named, and no word of a remainder
  Share covered, base_covered;
  Share caught;          ///< contradicted garbage: found under its name
  Share remarked;        ///< other garbage: any finding
  Share false_findings;  ///< sessions in which something is found that is not there
  std::size_t undecidable = 0, lacking = 0, not_made = 0, failed = 0, unchecked = 0;
  double seconds = 0, slowest = 0;  ///< median and 95 % quantile
  double secret = 0;                ///< median error on secret runs where the names are right, true sigma
};
WideScores wide_score(std::span<const WideAnswer> answers);

/// A case in a line.
std::string line_of(const WideAnswer& answer);

/// The rows with their Wilson intervals, then single and healthy cases broken down by trait, in Markdown.
std::string wide_tables(std::span<const WideAnswer> answers);

/// The rows as JSON: `{"rows": [{"what", "count", "of", "low", "high"}], ...}`.
std::string wide_summary(std::span<const WideAnswer> answers);

}  // namespace emtb::blind::wide
