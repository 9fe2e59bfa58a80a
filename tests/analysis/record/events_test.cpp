// A log in which each signal has rows of its own.
#include <gtest/gtest.h>

#include <vector>

#include "analysis/record/dataset.h"
#include "session/held_reference.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

/// A motor at several voltages, each signal read at times of its own.
/// @param meter [s] between the readings of the current
emtb::Run events(double meter) {
  emtb::Run run;
  run.name = "events";
  synthetic::Noise noise(9);
  const auto read = [&](Signal signal, double first, double every, const auto& value) {
    for (double t = first; t < 8; t += every) synthetic::add_reading(run, signal, t, value(t));
  };
  read(Signal::u_ref, 0, 1, [](double t) { return t < 0.5 ? 0.0 : 1 + static_cast<int>(t) % 3; });
  read(Signal::omega, 0.003, 0.02, [&](double t) { return 50 * t + noise(0.1); });
  read(Signal::i_a, 0.001, meter, [&](double) { return 1 + noise(0.01); });
  return run;
}

Functional functional_of(emtb::Run run, Signal signal) {
  hold_references(std::span(&run, 1));
  const Dataset data = prepare(std::vector{run}, {}, synthetic::servo_model());
  return data.train.front().find(signal)->functional;
}

TEST(Events, AreInstantsThoughEachSignalHasAPartOfTheRows) {
  EXPECT_EQ(functional_of(events(0.01), Signal::omega), Functional::instant);
  EXPECT_EQ(functional_of(events(0.01), Signal::i_a), Functional::instant);
}

TEST(Events, OfAMeterThatReadsSeldomAreMeans) {
  EXPECT_EQ(functional_of(events(0.5), Signal::i_a), Functional::mean);
  EXPECT_EQ(functional_of(events(0.5), Signal::omega), Functional::instant);
}

}  // namespace
}  // namespace emtb
