#include "report/words.h"

#include "figures/number.h"
#include "report/symbols.h"

namespace emtb {

std::string with_space(const std::string& unit) { return unit.empty() ? "" : " " + unit; }

std::string value_of(const Parameter& p) {
  return (p.std_error ? printed(p.value, *p.std_error) : printed(p.value)) + with_space(printed_unit(p.unit));
}

std::string joined(const std::vector<std::string>& words, const std::string& last) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == words.size() ? last : ", ") + words[i];
  }
  return text;
}

std::string judged_on(const Diagnosis& d) {
  return d.judged_on_training ? "the one run there is"
         : d.left_one_out     ? "runs held out in turn"
                              : "runs that no fit has seen";
}

std::string floors(double error) { return printed(error, 3) + " noise floors"; }

std::string source_in_words(const NoiseFloor& noise) {
  if (noise.from == FloorSource::declared) return "declared in the model file";
  if (noise.from == FloorSource::settled) return "scatter about a straight line in settled stretches";
  if (noise.from == FloorSource::repeats) return "what repeated runs differ by";
  if (noise.from == FloorSource::resolution) return "the instrument's resolution, LSB/√12";
  if (noise.from == FloorSource::differences)
    return noise.lower_bound ? "differences of readings: a lower bound, coloured noise may be 3-4 times more"
                             : "differences of readings";
  return std::string(name_of(noise.from));
}

}  // namespace emtb
