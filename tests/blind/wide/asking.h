#pragma once

#include "tests/blind/wide/wide_answer.h"

namespace emtb::blind::wide {

/// What is asked, and for how long an answer is awaited.
struct Asking {
  std::filesystem::path emtb;  ///< the command line program
  double longest = 600;        ///< [s] of one diagnosis
  bool oracle = true;
};

/// A case that could not be made.
WideAnswer answer_not_made(Kind kind, std::size_t number, const std::string& why);

/// `emtb diagnose` and `emtb check` on the files of a case, as its user would call them. A diagnosis that fails is an
/// answer, too.
WideAnswer ask(const WideCase& c, const CaseFiles& files, const Asking& how);

/// The command as a user types it in the case's folder.
std::vector<std::string> diagnose_arguments(const CaseFiles& files);

/// `emtb check` is there.
bool has_check(const std::filesystem::path& emtb, const std::filesystem::path& folder);

}  // namespace emtb::blind::wide
