#include "analysis/fit/circumstances.h"

namespace emtb {

Circumstances circumstances_of(const Dataset& data) {
  Circumstances as_set{data.timing, {}};
  for (const auto* records : {&data.train, &data.held_out}) {
    for (const Record& record : *records) as_set.starts.push_back(record.excitation.initial);
  }
  return as_set;
}

void set(Dataset& data, const Circumstances& circumstances) {
  set_timing(data, circumstances.timing);
  auto start = circumstances.starts.begin();
  for (auto* records : {&data.train, &data.held_out}) {
    for (Record& record : *records) record.excitation.initial = *start++;
  }
}

}  // namespace emtb
