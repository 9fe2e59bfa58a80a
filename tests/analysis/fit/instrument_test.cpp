#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "analysis/fit/residuals.h"
#include "analysis/record/dataset.h"
#include "model/simulation.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

constexpr double row = 0.02;  // [s] half of the servo's mechanical time constant
constexpr std::size_t rows = 60;
constexpr double behind = 0.625;  // of a row: a whole number of the finer ones
constexpr std::size_t finer = 200;

/// A driver that follows at once, and a motor without inductance.
Model coarsely_logged_servo() {
  Model m = synthetic::servo_model();
  m.driver = DriverModel{.gain = 1, .min = -24, .max = 24};
  return m;
}

/// Steps of ten rows, in rows that are so many times shorter.
Excitation stepping(const Model& model, std::size_t times) {
  Excitation x;
  for (std::size_t k = 0; k <= rows * times; ++k) {
    x.t.push_back(row * static_cast<double>(k) / static_cast<double>(times));
    x.u_ref.push_back(std::array{6.0, -4.0, 9.0, 2.0, -7.0, 0.0}.at(k / times / 10 % 6));
  }
  x.longest_step = model.mechanical_time_constant() / 10;
  return x;
}

/// [SI] The largest error of readings, once a record of them is prepared.
double largest_left(const Model& model, Observation o, const Timing& timing,
                    const std::function<void(Excitation&)>& change) {
  o.sigma.assign(o.value.size(), 1);
  Record record;
  record.excitation = stepping(model, 1);
  record.excitation.quick_step = record.excitation.longest_step / 5;
  record.observations = {std::move(o)};
  set_timing(std::span(&record, 1), timing);
  change(record.excitation);
  const auto left = simulated_residuals(record, record.structure(model), model.values(), {});
  return left.front().value.lpNorm<Eigen::Infinity>();
}

/// [SI] The largest error of a reading that is behind, were its instrument perfect.
/// @param straight the signal is taken as straight from row to row
double off_by(Signal signal, bool straight) {
  const Model model = coarsely_logged_servo();
  Trajectory<double> fine;
  simulate<double>(model.structure(), model.values(), stepping(model, finer), fine);
  Observation o;
  o.signal = signal;
  for (std::size_t k = 2; k <= rows; ++k) {  // before the first row nothing is known
    o.first.push_back(static_cast<std::uint32_t>(k));
    o.value.push_back(fine.of(signal)[k * finer - static_cast<std::size_t>(behind * finer)]);
  }
  o.last = o.first;
  Timing timing;
  timing.late[signal] = behind;
  return largest_left(model, o, timing, [&](Excitation& x) {
    if (straight) x.reads_shaft_late = false;
  });
}

TEST(LateInstrument, ReadsWhatTheShaftDoesWithinALongRow) {
  for (const Signal signal : {Signal::omega, Signal::theta, Signal::i_a})
    EXPECT_LT(off_by(signal, false), 0.1 * off_by(signal, true)) << info(signal).column;
}

TEST(LateInstrument, ReadsOfAShaftThatTurnsWhenARunBeginsWhatItDidBefore) {
  constexpr std::size_t begin = 12, end = 19;  // amid a step
  const Model model = coarsely_logged_servo();
  Trajectory<double> fine;
  simulate<double>(model.structure(), model.values(), stepping(model, finer), fine);
  const std::vector<double>& omega = fine.of(Signal::omega);
  Observation o;
  o.signal = Signal::omega;
  Record record;
  record.excitation = stepping(model, 1);
  Excitation& x = record.excitation;
  x.u_ref.assign(end - begin, x.u_ref[begin]);
  x.t.resize(end - begin);
  x.initial.omega = omega[begin * finer];
  for (std::size_t k = begin; k < end; ++k) {
    o.first.push_back(static_cast<std::uint32_t>(k - begin));
    o.value.push_back(omega[k * finer - static_cast<std::size_t>(behind * finer)]);
  }
  o.last = o.first;
  o.sigma.assign(o.value.size(), 1);
  record.observations = {o};
  Timing timing;
  timing.late[Signal::omega] = behind;
  set_timing(std::span(&record, 1), timing);
  const auto left = simulated_residuals(record, record.structure(model), model.values(), {});
  const double as_if_it_had_stood_still = o.value.front() - x.initial.omega;
  EXPECT_LT(std::abs(left.front().value[0]), 0.5 * std::abs(as_if_it_had_stood_still));
}

Model with_inductance(Model model) {
  const std::size_t effect = effect_index("armature_inductance");
  model.include(effect);
  model.parameters_of(effect).front().value = 0.004;
  return model;
}

/// [SI] The largest error of what a perfect instrument reads that averages over each row.
/// @param straight the signal is taken as straight from row to row
double mean_off_by(const Model& model, Signal signal, bool straight) {
  Trajectory<double> fine;
  simulate<double>(model.structure(), model.values(), stepping(model, finer), fine);
  const std::vector<double>& y = fine.of(signal);
  Observation o;
  o.signal = signal;
  o.functional = Functional::mean;
  for (std::size_t k = 1; k <= rows; ++k) {
    double sum = 0;
    for (std::size_t j = (k - 1) * finer; j < k * finer; ++j) sum += 0.5 * (y[j] + y[j + 1]);
    o.first.push_back(static_cast<std::uint32_t>(k - 1));
    o.last.push_back(static_cast<std::uint32_t>(k));
    o.value.push_back(sum / finer);
  }
  return largest_left(model, o, {}, [&](Excitation& x) {
    if (straight) x.reads_means = false;
  });
}

TEST(AveragingInstrument, ReadsTheMeanOfWhatHappensWithinALongRow) {
  const Model model = coarsely_logged_servo(), coiled = with_inductance(model);
  for (const Signal signal : {Signal::omega, Signal::i_a, Signal::e_a})
    EXPECT_LT(mean_off_by(model, signal, false), 0.1 * mean_off_by(model, signal, true)) << info(signal).column;
  EXPECT_LT(mean_off_by(coiled, Signal::i_a, false), 0.1 * mean_off_by(coiled, Signal::i_a, true));
}

TEST(AveragingInstrument, ReadsWhatItsOffsetAdds) {
  Model model = coarsely_logged_servo();
  const std::size_t effect = effect_index("current_offset");
  model.include(effect);
  const double without = mean_off_by(model, Signal::i_a, false);
  model.parameters_of(effect).front().value = 0.1;
  EXPECT_NEAR(mean_off_by(model, Signal::i_a, false), without, 1e-9);
}

}  // namespace
}  // namespace emtb
