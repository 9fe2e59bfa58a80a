#include "analysis/fit/residuals.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "analysis/fit/summed_pass.h"
#include "analysis/record/noise_floor.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using synthetic::record;
using synthetic::servo_model;

using Places = std::vector<std::vector<std::size_t>>;

/// A run with a fast speed, a slow meter and a measured voltage; every reading weighs 0.1.
std::vector<Record> records() {
  emtb::Run run = record({}, synthetic::steps, 1e-3, {.omega = 0.1, .i_a = 0.01, .e_a = 0.05});
  const Series fast = run.at(Signal::i_a);
  Series meter;
  for (std::size_t k = 400; k < fast.t.size(); k += 400) {
    meter.t.push_back(fast.t[k]);
    meter.value.push_back(fast.value[k]);
  }
  meter.window = 0.25;
  run.signals[Signal::i_a] = meter;
  std::vector<Record> all{{observe_run(run, servo_model())}};
  for (Observation& o : all[0].observations) o.sigma.assign(o.size(), 0.1);
  return all;
}

std::vector<Residuals> of(const std::vector<Record>& runs, const Model& model, const Places& moved) {
  return residuals(runs, model, model.values(), moved);
}

TEST(Residuals, AreMeasuredLessSimulatedInUnitsOfSigma) {
  const auto runs = records();
  const Model model = servo_model();
  Trajectory<double> y;
  simulate<double>(runs[0].structure(model), model.values(), runs[0].excitation, y);
  const std::vector<Residuals> all = of(runs, model, {});
  ASSERT_EQ(all.size(), 3U) << "e_a, i_a, omega";
  for (const Residuals& r : all) {
    const auto& o = *std::ranges::find(runs[0].observations, r.signal, &Observation::signal);
    const auto& signal = r.signal == Signal::omega ? y.omega : r.signal == Signal::i_a ? y.i_a : y.e_a;
    ASSERT_EQ(static_cast<std::size_t>(r.value.size()), o.size());
    for (std::size_t i = 0; i < o.size(); ++i) {
      const double predicted = o.predicted(i, [&](std::size_t k) { return signal[k]; });
      EXPECT_NEAR(r.value[static_cast<Eigen::Index>(i)], (o.value[i] - predicted) / o.sigma[i], 1e-8);
    }
    EXPECT_FALSE(r.informed()) << "no sensitivities were wanted";
  }
}

TEST(Residuals, AreTheSameHandedOverAsTheSimulationGoes) {
  const auto runs = records();
  Model model = servo_model();
  model.include(effect_index("coulomb_friction"));
  const std::vector<double> values = model.values();
  Places moved;
  for (std::size_t count = 0; count <= 12; ++count) {  // none, a narrow pass, a wide one, more than one holds
    const std::vector<Residuals> whole = simulated_residuals(runs[0], runs[0].structure(model), values, moved);
    std::vector<Eigen::Index> next(whole.size(), 0);
    visit_simulated_residuals(
        runs[0], runs[0].structure(model), values, moved,
        [&](std::size_t s, Eigen::Index first, const Eigen::VectorXd& value, const Eigen::MatrixXd& sensitivity) {
          ASSERT_EQ(first, next[s]) << "in their order";
          next[s] += value.size();
          EXPECT_EQ(value, whole[s].value.segment(first, value.size()));
          ASSERT_EQ(sensitivity.cols(), static_cast<Eigen::Index>(moved.size()));
          if (whole[s].informed()) {
            EXPECT_EQ(sensitivity, whole[s].sensitivity.middleRows(first, value.size()));
          } else {
            EXPECT_TRUE(sensitivity.isZero(0));
          }
        });
    for (std::size_t s = 0; s < whole.size(); ++s) EXPECT_EQ(next[s], whole[s].value.size());
    moved.push_back({count < 5 ? count : values.size() - 1});
  }
}

TEST(Residuals, HaveTheSensitivitiesOfTheirDifferencesForAnyNumberOfParameters) {
  const auto runs = records();
  Model model = servo_model();
  model.tie.clear();
  for (const char* id : {"armature_inductance", "coulomb_friction", "windage", "load_torque", "tacho_lag"}) {
    model.include(effect_index(id));
  }
  const std::vector<double> values{1.1, 0.041, 0.043, 2e-5, 5e-5, 2e-3, 0.002, 2e-8, 0.001, 0.005};
  Places moved;
  for (std::size_t place = 0; place < values.size(); ++place) {
    moved.push_back({place});  // one to ten columns: a narrow pass, a wide one, both
    const std::vector<Residuals> all = residuals(runs, model, values, moved);
    ASSERT_EQ(all.size(), 3U);
    for (std::size_t j = 0; j <= place; ++j) {
      const double step = 1e-5 * values[j];
      std::vector<double> up = values, down = values;
      up[j] += step;
      down[j] -= step;
      const auto above = residuals(runs, model, up, {}), below = residuals(runs, model, down, {});
      for (std::size_t s = 0; s < all.size(); ++s) {
        const Eigen::VectorXd expected = (below[s].value - above[s].value) / (2 * step);
        if (!all[s].informed()) {
          EXPECT_EQ(expected.norm(), 0);
          continue;
        }
        const Eigen::VectorXd found = all[s].sensitivity.col(static_cast<Eigen::Index>(j));
        EXPECT_LT((found - expected).norm(), 1e-5 * expected.norm() + 1e-12 * all[s].value.norm() / step)
            << info(all[s].signal).name << " parameter " << j << " of " << place + 1;
      }
    }
  }
}

TEST(Residuals, SensitivitiesOfTiedParametersAdd) {
  const auto runs = records();
  const Model model = servo_model();
  const auto tied = of(runs, model, {{1, 2}}), apart = of(runs, model, {{1}, {2}});
  ASSERT_EQ(std::ranges::count_if(tied, &Residuals::informed), 2) << "i_a, omega";
  for (std::size_t s = 0; s < tied.size(); ++s) {
    if (!tied[s].informed()) continue;
    EXPECT_LT((tied[s].sensitivity.col(0) - apart[s].sensitivity.rowwise().sum()).norm(),
              1e-9 * tied[s].sensitivity.norm());
  }
  EXPECT_EQ(moved_by(FreeParameters(model)), (Places{{0}, {1, 2}, {3}, {4}}));
}

TEST(Residuals, ASignalThatNoParameterMovesIsUninformed) {
  const auto runs = records();
  const std::vector<Residuals> all = of(runs, servo_model(), {{0}, {4}});
  ASSERT_EQ(all.size(), 3U);
  for (const Residuals& r : all) {
    EXPECT_EQ(r.informed(), r.signal != Signal::e_a) << info(r.signal).name;  // the driver is known
  }
}

TEST(Residuals, OfAllRecordsStandInTheirOrder) {
  auto runs = records();
  runs.push_back(runs[0]);
  runs.push_back(runs[0]);
  const auto all = of(runs, servo_model(), {});
  ASSERT_EQ(all.size(), 9U);
  for (std::size_t i = 0; i < all.size(); ++i) EXPECT_EQ(all[i].record, i / 3);
}

TEST(ErrorOfTheContract, CountsEachSignalEqually) {
  std::vector<Residuals> r(3);
  r[0] = {0, Signal::omega, Eigen::VectorXd::Constant(1000, 2.0), {}};
  r[1] = {1, Signal::omega, Eigen::VectorXd::Constant(3000, 4.0), {}};
  r[2] = {0, Signal::i_a, Eigen::VectorXd::Constant(10, 1.0), {}};
  const auto squares = mean_squares(r);
  EXPECT_DOUBLE_EQ(squares.at(Signal::omega), (1000 * 4 + 3000 * 16) / 4000.0);
  EXPECT_DOUBLE_EQ(squares.at(Signal::i_a), 1);
  EXPECT_DOUBLE_EQ(error_of(squares), std::sqrt((13.0 + 1) / 2));
}

/// Slow meter, fast speed, and e_a, which no parameter moves.
TEST(SummedPass, SaysWhatTheResidualsAndTheirSensitivitiesSumUpTo) {
  const auto runs = records();
  Model model = servo_model();
  model.tie.clear();
  for (const char* id : {"coulomb_friction", "brush_drop", "windage", "driver_gain_error", "stribeck_friction"})
    model.include(effect_index(id));
  const std::map<std::string, double> present{{"coulomb_friction.T_c", 0.002},  {"brush_drop.V_b", 0.3},
                                              {"brush_drop.i_lin", 0.1},        {"windage.c_w", 1e-7},
                                              {"stribeck_friction.T_s", 0.001}, {"stribeck_friction.omega_s", 20}};
  for (std::size_t i = 0; i < model.names().size(); ++i) {
    if (const auto known = present.find(model.names()[i]); known != present.end()) model.at(i).value = known->second;
  }
  const ModelStructure structure = runs[0].structure(model);
  const std::vector<double> values = model.values();
  Places each_alone;
  for (std::size_t i = 0; i < values.size(); ++i) each_alone.push_back({i});
  ASSERT_GT(each_alone.size(), 12U) << "more than three registers hold";
  ASSERT_LE(each_alone.size(), PassSums::most);
  const Places ten(each_alone.begin(), each_alone.begin() + 10);
  const Places four{{0}, {1, 2}, {3}, {4}}, five{{0}, {1}, {2}, {3}, {4}}, none{};
  for (const Places& moved : {none, four, five, ten, each_alone}) {
    for (const bool all_wanted : {true, false}) {
      std::vector<char> wanted(runs[0].observations.size(), 1);
      if (!all_wanted) wanted.back() = 0;
      const auto p = static_cast<Eigen::Index>(moved.size());
      Eigen::MatrixXd sts = Eigen::MatrixXd::Zero(p, p);
      Eigen::VectorXd str = Eigen::VectorXd::Zero(p);
      double rtr = 0;
      const std::vector<Residuals> each = simulated_residuals(runs[0], structure, values, moved);
      for (std::size_t s = 0; s < each.size(); ++s) {
        if (!wanted[s]) continue;
        rtr += each[s].value.squaredNorm();
        if (!each[s].informed()) continue;
        sts += each[s].sensitivity.transpose() * each[s].sensitivity;
        str += each[s].sensitivity.transpose() * each[s].value;
      }
      for (const PassSums& sums : {summed_pass(runs[0], structure, values, moved, wanted),
                                   summed_pass_for<Processor::any>(runs[0], structure, values, moved, wanted)}) {
        EXPECT_NEAR(sums.rtr, rtr, 1e-9 * rtr);
        for (Eigen::Index i = 0; i < p; ++i) {
          const auto row = static_cast<std::size_t>(i);
          EXPECT_NEAR(sums.str[row], str[i], 1e-9 * std::sqrt(sts(i, i) * rtr)) << i;
          for (Eigen::Index j = 0; j < p; ++j) {
            EXPECT_NEAR(sums.sts[row * PassSums::most + static_cast<std::size_t>(j)], sts(i, j),
                        1e-9 * std::sqrt(sts(i, i) * sts(j, j)))
                << i << ", " << j;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace emtb
