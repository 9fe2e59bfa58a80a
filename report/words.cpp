#include "report/words.h"

#include "figures/number.h"
#include "hal/unit.h"
#include "report/gauge_words.h"
#include "report/symbols.h"
#include "report/text.h"

namespace emtb {

std::string value_of(const Parameter& p) {
  return (is_determined(p) ? printed(p.value, *p.std_error) : printed(p.value, p.std_error ? 2 : 4)) +
         with_space(printed_unit(p.unit));
}

std::string value_in_words(const Parameter& p) {
  return p.symbol + " = " +
         (is_determined(p) ? pretty(p.value, *p.std_error, p.unit)
          : p.std_error    ? pretty(p.value, 2) + with_space(p.unit) + " (not determined)"
                           : pretty(p.value) + with_space(p.unit));
}

std::vector<Parameter> fitted_values(const Diagnosis& d, const MissingEffect& m) {
  std::vector<Parameter> fitted;
  for (std::size_t i = 0; i < m.parameters.size(); ++i) {
    const bool is_phase = d.about(m.effect).parameters()[i].role == Role::phase;
    if (!is_phase || !m.parameters[i].fixed) fitted.push_back(m.parameters[i]);
  }
  return fitted;
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

std::string fitted_too_in_words(const Diagnosis& d) {
  const bool one = d.fitted_too.size() == 1;
  return joined(d.fitted_too) +
         (one ? ", which the training runs do not foretell, was fitted, too, and judges no longer"
              : ", which the training runs do not foretell, were fitted, too, and judge no longer");
}

std::string floors(double error) { return printed(error, 3) + " noise floors"; }

std::string cut_in_words() {
  return "The search was cut before all was tried, so more may be told of what is left: `--effort 10` goes on ten "
         "times as long.";
}

std::string source_in_words(const NoiseFloor& noise) {
  switch (noise.from) {
    case FloorSource::declared:
      return "declared in the model file";
    case FloorSource::counts:
      return "what whole counts of the encoder leave in a speed";
    case FloorSource::settled:
      return "scatter about a straight line in settled stretches";
    case FloorSource::repeats:
      return "what repeated runs differ by";
    case FloorSource::regression:
      return "scatter of the slow meter about a straight line through the fast signals beside it";
    case FloorSource::differences:
      return noise.lower_bound   ? "differences of readings: a lower bound, coloured noise may be 3-4 times more"
             : noise.upper_bound ? "differences of readings: an upper bound, the signal bends between them"
                                 : "differences of readings";
    case FloorSource::resolution:
      return "the instrument's resolution, LSB/√12";
    case FloorSource::accuracy:
      return "as exact as a simulation is: 2e-4 of how much the signal varies";
    case FloorSource::assumed:
      return "assumed: a thousandth of the signal's range";
  }
  return std::string(name_of(noise.from));
}

std::string autocorrelation_in_words(const NoiseFloor& noise) {
  return noise.from == FloorSource::settled ? printed(noise.autocorrelation, 2) : "–";
}

}  // namespace emtb
