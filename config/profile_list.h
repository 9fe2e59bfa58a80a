#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "experiment/profile.h"

namespace emtb {

/// A profile as a person chooses it.
struct ListedProfile {
  std::filesystem::path path;
  std::string name, kind;
  std::string about;  ///< what it is for: the comment that its file begins with, as one paragraph
  Profile profile;
};

/// @param name a file, or the name of one that comes with emtb
/// @throws ConfigError where it is not there, or is no profile.
ListedProfile listed_profile(const std::string& name);

/// All profiles that come with emtb, by name.
/// @throws ConfigError where their folder is not there.
std::vector<ListedProfile> shipped_profiles();

}  // namespace emtb
