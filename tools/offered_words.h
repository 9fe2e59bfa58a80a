#pragma once

#include <string>
#include <vector>

#include "config/profile_list.h"
#include "hal/signal.h"
#include "model/catalogue.h"

namespace emtb {

/// What a shell offers where one of these is meant.

inline std::vector<std::string> effect_ids() {
  std::vector<std::string> ids;
  for (const EffectInfo& effect : effect_catalogue()) ids.emplace_back(effect.id);
  return ids;
}

inline std::vector<std::string> profile_names() {
  std::vector<std::string> names;
  for (const ListedProfile& profile : shipped_profiles()) names.push_back(profile.name);
  return names;
}

inline std::vector<std::string> signal_names() {
  std::vector<std::string> names;
  for (const Signal signal : all_signals()) names.emplace_back(info(signal).name);
  return names;
}

}  // namespace emtb
