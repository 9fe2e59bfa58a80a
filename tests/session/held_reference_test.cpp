#include "session/held_reference.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "session/spec.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

using testing::ElementsAre;

TEST(HeldReference, StandsInEachRowFromItsFirstValueOn) {
  std::vector<emtb::Run> runs(1);
  runs[0].signals[Signal::u_ref] = {.t = {0.2, 0.5}, .value = {0, 3}, .window = 0, .lsb = 0, .source = {}};
  runs[0].signals[Signal::i_a] = {.t = {0.1, 0.3, 0.6}, .value = {1, 2, 3}, .window = 0, .lsb = 0, .source = {}};
  runs[0].signals[Signal::omega] = {.t = {0.3, 0.4}, .value = {5, 6}, .window = 0, .lsb = 0, .source = {}};
  hold_references(runs);
  EXPECT_THAT(runs[0].at(Signal::u_ref).t, ElementsAre(0.2, 0.3, 0.4, 0.5, 0.6));
  EXPECT_THAT(runs[0].at(Signal::u_ref).value, ElementsAre(0, 0, 0, 3, 3));
  EXPECT_EQ(runs[0].at(Signal::i_a).t.size(), 3);
}

TEST(HeldReference, IsLeftAloneWhereItIsWrittenAsOftenAsSomethingIsRead) {
  std::vector<emtb::Run> runs(1);
  for (int k = 0; k < 100; ++k) {
    runs[0].signals[Signal::u_ref].t.push_back(0.01 * k);
    runs[0].signals[Signal::u_ref].value.push_back(k);
    runs[0].signals[Signal::omega].t.push_back(0.01 * k - 1e-4);  // a card reads just before the loop writes
    runs[0].signals[Signal::omega].value.push_back(k);
  }
  const std::vector<double> before = runs[0].at(Signal::u_ref).t;
  hold_references(runs);
  EXPECT_EQ(runs[0].at(Signal::u_ref).t, before);
}

class HeldReferenceOfAFile : public Scratch {};

TEST_F(HeldReferenceOfAFile, IsThatOfALogOfEvents) {
  const auto path = write("events.csv", "t_s,u_ref_V,omega_rad_s\n0,2,\n0.01,,1\n0.02,,2\n0.03,4,\n0.04,,3\n");
  const std::vector<emtb::Run> runs = read_runs(path.string());
  EXPECT_THAT(runs.at(0).at(Signal::u_ref).value, ElementsAre(2, 2, 2, 4, 4));
}

}  // namespace
}  // namespace emtb
