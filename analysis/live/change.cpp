#include "analysis/live/change.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "model/catalogue.h"
#include "model/structure.h"

namespace emtb {
namespace {

std::string with_places(double value, int places) {
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), "%.*f", places, value);
  return text.data();
}

/// `0.0201 +- 0.0012`: two digits of the error.
std::string size_in_words(const LiveSuspect& s) {
  const double size = std::abs(s.change);
  if (!(s.std_error > 0) || !std::isfinite(size)) return with_places(size, 4);
  const int exponent = static_cast<int>(std::floor(std::log10(s.std_error)));
  if (exponent >= -8 && exponent <= 3) {
    const int places = std::max(0, 1 - exponent);
    return with_places(size, places) + " +- " + with_places(s.std_error, places);
  }
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.3g +- %.2g", size, s.std_error);
  return text.data();
}

/// What a person would look for.
ChangeWords words_for(std::string_view name) {
  const auto base = std::ranges::find(base_parameters, name, &BaseParameter::symbol);
  if (base != base_parameters.end()) return base->changed;
  for (const std::size_t effect : watched_effects()) {
    const EffectInfo& about = effect_catalogue()[effect];
    if (full_name(about) == name) return about.changed;
  }
  return {};
}

}  // namespace

std::string describe(const LiveChange& change) {
  std::string text = "since " + with_places(change.since, 1) + " s ";
  const std::string at = "at " + with_places(change.omega, std::abs(change.omega) < 10 ? 1 : 0) + " rad/s and " +
                         with_places(change.i_a, 2) + " A";
  if (change.suspects.empty()) {
    return text + "the motor is not as before, and nothing that is looked for explains it; it shows " + at;
  }
  const LiveSuspect& best = change.suspects.front();
  const ChangeWords words = words_for(best.name);
  const bool more = best.change > 0;
  const std::string much = size_in_words(best) + " " + best.unit;
  text += words.what.empty() ? best.name + " is" : std::string(words.what);
  text += " " + much + (more ? " more than before" : " less than before");
  if (!words.what.empty()) text += ": " + std::string(more ? words.more : words.less);
  text += " (" + best.name;
  for (std::size_t k = 1; k < change.suspects.size(); ++k) {
    text += (k == 1 ? "; tied with " : ", ") + change.suspects[k].name;
  }
  return text + "; it shows " + at + ")";
}

}  // namespace emtb
