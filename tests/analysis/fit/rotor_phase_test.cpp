#include "analysis/fit/rotor_phase.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "analysis/record/noise_floor.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

constexpr double sigma_omega = 0.1, sigma_i_a = 0.002;  // [rad/s], [A]
constexpr double wander = 0.01;                         // [rad^2/s] of the measured angle

/// A servo that cogs, and what of it was read: readings of the model itself, turned at the start.
struct Cogging {
  Model model = synthetic::servo_model();
  Record record;
  std::vector<double> wandered;  ///< [rad] the measured angle less the shaft's, at each time

  /// @param parameters of cogging, which at a phase of -N turned starts between two teeth, and of an eccentric load
  /// where more
  Cogging(const std::vector<double>& parameters, double turned, bool wanders) {
    model.include(effect_index("cogging"));
    if (parameters.size() > 3) model.include(effect_index("eccentric_load"));
    std::vector<double> values = model.values();
    std::ranges::copy(parameters, values.begin() + 5);
    for (std::size_t i = 0; i < values.size(); ++i) model.at(i).value = values[i];
    const Run run = synthetic::record({}, synthetic::steps, 1e-3, {.omega = sigma_omega});
    record = {observe_run(run, model)};
    record.measured_voltage = false;
    Excitation& x = record.excitation;
    std::vector<double> truth = values;
    truth.push_back(turned);
    x.angle.clear();
    Trajectory<double> y;
    simulate<double>(record.structure(model), truth, x, y);
    synthetic::Noise noise(5);
    for (Observation& o : record.observations) {
      const auto& signal = o.signal == Signal::omega ? y.omega : o.signal == Signal::i_a ? y.i_a : y.e_a;
      const double sigma = o.signal == Signal::omega ? sigma_omega : o.signal == Signal::i_a ? sigma_i_a : 0.02;
      for (std::size_t i = 0; i < o.size(); ++i) {
        o.value.edit()[i] = o.predicted(i, [&](std::size_t k) { return signal[k]; }) + noise(sigma);
      }
      o.sigma.assign(o.size(), sigma);
    }
    double away = 0;
    for (std::size_t k = 0; k < x.t.size(); ++k) {
      if (wanders && k > 0) away += noise(std::sqrt(wander * (x.t[k] - x.t[k - 1])));
      wandered.push_back(away);
      x.angle.push_back(y.theta[k] - turned + away);
      if (wanders) x.angle_pull.push_back(4 * std::abs(y.omega[k]));
    }
    if (wanders) record.angle_wander = wander;
  }

  std::vector<double> values() const { return model.values(); }
  ModelStructure structure() const { return record.structure(model); }
  double error_at(const RotorPhase& phase) const {
    return error_of(mean_squares(residuals_at_phase(record, structure(), values(), {}, phase).residuals));
  }
};

TEST(BestTurn, IsTheLowestOfAllValleysWhereTwoOrdersRepeat) {
  for (const double turned : {0.4, 2.0, 5.5}) {                      // [rad]
    const Cogging c({0.004, 24.0, 0.3, 0.003, 0.0}, turned, false);  // [N m], [1/turn], [rad], [N m], [rad]
    const RotorPhase phase = best_phase(c.record, c.structure(), c.values());
    ASSERT_EQ(phase.at.size(), 1U) << "an angle that does not wander needs no more";
    EXPECT_NEAR(phase.at.front(), turned, 2e-3);
  }
}

TEST(BestTurn, IsNoneWhereNothingRepeats) {
  const Cogging c({0.004, 6.0, -2.4}, 0.4, true);
  const Model plain = synthetic::servo_model();
  EXPECT_TRUE(best_phase(c.record, c.record.structure(plain), plain.values()).at.empty());
}

TEST(BestTurn, FollowsAnAngleThatWanders) {
  Cogging c({0.004, 6.0, -2.4}, 0.4, true);
  const RotorPhase phase = best_phase(c.record, c.structure(), c.values());
  ASSERT_GT(phase.at.size(), 5U);
  EXPECT_LT(c.error_at(phase), 1.05);
  // As likely as the wander that there was: about one square a knot.
  EXPECT_LT(phase.unlikely, 4 * static_cast<double>(phase.at.size()));
  EXPECT_GT(phase.unlikely, 0.1 * static_cast<double>(phase.at.size()));
  c.record.angle_wander = 0;
  EXPECT_GT(c.error_at(best_phase(c.record, c.structure(), c.values())), 1.3) << "one phase for all of the run";
}

TEST(BestTurn, FromNearIsAsGoodAsASearch) {
  const Cogging c({0.004, 6.0, -2.4}, 0.4, true);
  const RotorPhase searched = best_phase(c.record, c.structure(), c.values());
  RotorPhase near = searched;
  for (double& at : near.at) at += 0.02;
  const RotorPhase followed = best_phase(c.record, c.structure(), c.values(), &near);
  EXPECT_LT(c.error_at(followed), c.error_at(searched) + 5e-3);
}

TEST(ResidualsAtBestPhases, FollowEachRecordFromWhereItsPhaseIsKnown) {
  const Cogging a({0.004, 6.0, -2.4}, 0.4, true), b({0.004, 6.0, -2.4}, 0.7, false);
  const std::vector<Record> records{a.record, b.record};
  const ResidualsAtPhases searched = residuals_at_best_phases(records, a.model, a.values(), {});
  ASSERT_EQ(searched.phases.size(), 2U);
  EXPECT_NEAR(searched.phases[1].at.front(), 0.7, 5e-3);
  RotorPhases near = searched.phases;
  for (RotorPhase& phase : near) {
    for (double& at : phase.at) at += 0.02;
  }
  const ResidualsAtPhases followed = residuals_at_best_phases(records, a.model, a.values(), {}, near);
  EXPECT_NEAR(sum_of_squares(followed.residuals), sum_of_squares(searched.residuals),
              1e-2 * sum_of_squares(searched.residuals));
  EXPECT_EQ(followed.residuals.back().record, 1U);
}

TEST(SquaresAtBestPhases, AreThoseOfTheResidualsThere) {
  const Cogging wanders({0.004, 6.0, -2.4}, 0.4, true), turned({0.004, 6.0, -2.4}, 0.7, false);
  Model without = turned.model;
  without.exclude(effect_index("cogging"));
  for (const auto& [record, model] : {std::pair(wanders.record, wanders.model), std::pair(turned.record, turned.model),
                                      std::pair(turned.record, without)}) {
    const std::vector<Record> records{record};
    const ResidualsAtPhases seen = residuals_at_best_phases(records, model, model.values(), {});
    const SquaresAtPhases summed = squares_at_best_phases(records, model);
    EXPECT_NEAR(summed.squares, sum_of_squares(seen.residuals), 1e-9 * summed.squares);
    EXPECT_EQ(summed.phases.front().at, seen.phases.front().at);
    EXPECT_NEAR(squares_at_best_phases(records, model, seen.phases).squares,
                sum_of_squares(residuals_at_best_phases(records, model, model.values(), {}, seen.phases).residuals),
                1e-9 * summed.squares);
  }
}

TEST(ResidualsAtPhase, GiveAGradientOfTheirSquaresAndOfWhatIsUnlikely) {
  const Cogging c({0.004, 6.0, -2.4}, 0.4, true);
  std::vector<double> values = c.values();
  values[5] *= 0.97;  // T_cog
  const std::vector<std::vector<std::size_t>> moved{{5}};
  const auto cost = [&](double T_cog, const RotorPhase& from) {
    std::vector<double> there = values;
    there[5] = T_cog;
    RotorPhase phase = from;
    for (int k = 0; k < 5; ++k) phase = best_phase(c.record, c.structure(), there, &phase);
    return sum_of_squares(residuals_at_phase(c.record, c.structure(), there, {}, phase).residuals) + phase.unlikely;
  };
  RotorPhase phase = best_phase(c.record, c.structure(), values);
  for (int k = 0; k < 5; ++k) phase = best_phase(c.record, c.structure(), values, &phase);
  const auto [seen, prior, course] = residuals_at_phase(c.record, c.structure(), values, moved, phase);
  double downhill = prior.str[0];
  for (const Residuals& r : seen) {
    if (r.informed()) downhill += r.sensitivity.col(0).dot(r.value);
  }
  const double step = 0.01 * values[5];
  const double slope = (cost(values[5] + step, phase) - cost(values[5] - step, phase)) / (2 * step);
  // Not nearer: a phase at one knot is taken for the same phase throughout, as seen from around that knot.
  EXPECT_NEAR(-2 * downhill, slope, 0.2 * std::abs(slope));
}

TEST(PhaseCourse, LeadsToWhereTheBestPhaseGoes) {
  for (const bool wanders : {false, true}) {
    const Cogging c({0.004, 6.0, -2.4}, 0.4, wanders);
    const std::vector<std::vector<std::size_t>> moved{{7}};  // the phase of the wave
    RotorPhase phase = best_phase(c.record, c.structure(), c.values());
    const ResidualsAtPhase seen = residuals_at_phase(c.record, c.structure(), c.values(), moved, phase);
    ASSERT_TRUE(seen.course.known());
    const double change = 0.3;  // [rad], six waves a turn
    const RotorPhase there = seen.course.from(c.record, phase, Eigen::VectorXd::Constant(1, change));
    ASSERT_EQ(there.at.size(), phase.at.size());
    // Where the shaft hardly turns the phase is told by what stands beside it.
    const std::size_t middle = phase.at.size() / 2;
    EXPECT_NEAR(there.at[middle] - phase.at[middle], -change / 6, 0.1 * change / 6);
  }
}

}  // namespace
}  // namespace emtb
