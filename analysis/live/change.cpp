#include "analysis/live/change.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>

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
struct ChangeWords {
  std::string_view name, before, behind, more, less;
};
constexpr std::array change_words{
    ChangeWords{"R_a", "the armature has ", " {} than before", "has it warmed up?", "has it cooled down?"},
    ChangeWords{"K_b", "back-EMF and torque constant are ", " {} than before", "a stronger field?",
                "has the field weakened, or warmed up?"},
    ChangeWords{"K_m", "the torque constant is ", " {} than before", "a stronger field?",
                "has the field weakened, or warmed up?"},
    ChangeWords{"B", "viscous friction is ", " {} than before", "does something drag on the shaft?",
                "has the grease warmed up?"},
    ChangeWords{"J", "the inertia is ", " {} than before", "was something added to the shaft?",
                "was something taken from the shaft?"},
    ChangeWords{"coulomb_friction.T_c", "the motor needs ", " {} than before", "a brake left on, does something rub?",
                "a brake released?"},
    ChangeWords{"load_torque.T_L", "the load takes ", " {} than before", "a brake left on?", "a brake released?"},
    ChangeWords{"tacho_offset.omega_0", "the tacho reads ", " {} than before", "has its zero moved?",
                "has its zero moved?"},
    ChangeWords{"current_offset.i_0", "the current is read ", " {} than before", "has the sensor's zero moved?",
                "has the sensor's zero moved?"}};

}  // namespace

std::string describe(const LiveChange& change) {
  std::string text = "since " + with_places(change.since, 1) + " s ";
  const std::string at = "at " + with_places(change.omega, std::abs(change.omega) < 10 ? 1 : 0) + " rad/s and " +
                         with_places(change.i_a, 2) + " A";
  if (change.suspects.empty()) {
    return text + "the motor is not as before, and nothing that is looked for explains it; it shows " + at;
  }
  const LiveSuspect& best = change.suspects.front();
  const auto known = std::ranges::find(change_words, best.name, &ChangeWords::name);
  const bool more = best.change > 0;
  const std::string much = size_in_words(best) + " " + best.unit;
  if (known == change_words.end()) {
    text += best.name + " is " + much + (more ? " more than before" : " less than before");
  } else {
    std::string behind(known->behind);
    behind.replace(behind.find("{}"), 2, more ? "more" : "less");
    text += std::string(known->before) + much + behind + ": " + std::string(more ? known->more : known->less);
  }
  text += " (" + best.name;
  for (std::size_t k = 1; k < change.suspects.size(); ++k) {
    text += (k == 1 ? "; tied with " : ", ") + change.suspects[k].name;
  }
  return text + "; it shows " + at + ")";
}

}  // namespace emtb
