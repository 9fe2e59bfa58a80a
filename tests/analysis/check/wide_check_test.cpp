// Benches drawn at random, with an effect hidden or none, whose recordings are good; then something is planted.
#include <gtest/gtest.h>

#include <numbers>

#include "tests/analysis/check/sweep.h"
#include "tests/blind/case.h"

namespace emtb {
namespace {

using blind::CaseKind;

TEST(WideCheck, EffectsAreNoFlawsAndWhatIsPlantedIsNamed) {
  planted::Counts all;
  int cases = 0, flawed = 0;
  constexpr double rpm = 60 / (2 * std::numbers::pi), milli = 1000;
  for (const CaseKind kind : {CaseKind::healthy, CaseKind::single, CaseKind::outside}) {
    for (std::size_t number = 0; number < (kind == CaseKind::single ? 12 : 4); ++number) {
      const blind::Case c = make_case(kind, number, 4, blind::Setting::brief);
      std::vector<emtb::Run> runs = c.train;
      runs.insert(runs.end(), c.held_out.begin(), c.held_out.end());
      planted::Sweep s(c.id, runs, &c.bench.model);
      ++cases;
      flawed += s.healthy().empty() ? 0 : 1;
      for (const DataFinding& f : s.healthy())
        std::cout << c.id << ": " << f.run << ": " << name_of(f.what) << ": " << f.text << "\n";
      for (const Signal signal : {Signal::omega, Signal::theta, Signal::e_a, Signal::i_a}) {
        if (!runs.front().has(signal)) continue;
        if (is_sparse(runs.front(), signal)) continue;
        s.plant_in_signal(signal, signal != Signal::e_a || runs.front().has(Signal::i_a));
      }
      s.plant_other_scale(Signal::omega, rpm);
      s.plant_other_scale(Signal::i_a, milli);
      s.plant_in_rows();
      all.add(s.counts());
    }
  }
  std::cout << flawed << " of " << cases << " good sets with a finding; " << all.text() << "\n";
  EXPECT_EQ(flawed, 0);
  EXPECT_GE(all.named, 0.95 * all.planted);
  EXPECT_LE(all.beside, 0.05 * all.planted);
}

}  // namespace
}  // namespace emtb
