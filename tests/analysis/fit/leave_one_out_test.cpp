#include "analysis/fit/leave_one_out.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "analysis/fit/residuals.h"
#include "analysis/record/dataset.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using synthetic::servo_model;
using synthetic::Truth;

constexpr synthetic::Sigma noisy{.omega = 0.1, .i_a = 0.01, .e_a = 0.02};
const std::vector<synthetic::Hold> there_and_back{{0.2, 0}, {0.5, -2}, {0.3, 4}, {0.5, 1}, {0.3, 0}};
const std::vector<synthetic::Hold> at_rest{{0.5, 0}};
const CalibrationOptions plain{.extra_starts = 0, .max_iterations = 60, .tolerance = 1e-9, .with_covariance = false};

Model noisy_servo() {
  Model model = servo_model();
  model.noise = {{Signal::omega, noisy.omega}, {Signal::i_a, noisy.i_a}, {Signal::e_a, noisy.e_a}};
  return model;
}

std::vector<Record> records_of(std::span<const std::vector<synthetic::Hold>> references, const Truth& of_the_last,
                               const Model& model) {
  std::vector<emtb::Run> runs;
  for (const auto& reference : references) {
    const bool is_last = runs.size() + 1 == references.size();
    runs.push_back(synthetic::record(is_last ? of_the_last : Truth{}, reference, 1e-3, noisy));
  }
  return prepare(runs, {}, model).train;
}

std::vector<Residuals> left_of(const Record& record, const Model& model,
                               std::span<const std::vector<std::size_t>> moved = {}) {
  return residuals(std::span(&record, 1), model, model.values(), moved);
}

double squares_of(const Record& record, const Model& model) { return sum_of_squares(left_of(record, model)); }

/// S'S and S'r of a record at a model, and r'r.
struct Equations {
  Eigen::MatrixXd sts;
  Eigen::VectorXd str;
  double rtr = 0;
};

Equations equations_of(std::span<const Record> records, const Model& model) {
  const auto moved = moved_by(FreeParameters(model));
  const auto n = static_cast<Eigen::Index>(moved.size());
  Equations sum{Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n), 0};
  for (const Record& record : records) {
    for (const Residuals& r : left_of(record, model, moved)) {
      sum.rtr += r.value.squaredNorm();
      if (!r.informed()) continue;
      sum.sts += r.sensitivity.transpose() * r.sensitivity;
      sum.str += r.sensitivity.transpose() * r.value;
    }
  }
  return sum;
}

/// r' (I + S C S')^-1 r of a record at what is fitted to the others, C the covariance of that fit.
double squares_foretold(const std::vector<Record>& records, std::size_t out, const Model& start) {
  std::vector<Record> others = records;
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(out));
  const Model fitted = calibrate(others, start, plain).model;
  const Equations known = equations_of(others, fitted), own = equations_of(std::span(&records[out], 1), fitted);
  return own.rtr - own.str.dot((known.sts + own.sts).ldlt().solve(own.str));
}

void expect_as_foretold(const std::vector<Record>& records, const Model& model, double part) {
  const Fit of_all = calibrate(records, model, plain);
  const std::vector<Model> judging = judged_in_turn(records, of_all, plain);
  ASSERT_EQ(judging.size(), records.size());
  for (std::size_t out = 0; out < records.size(); ++out) {
    const double foretold = squares_foretold(records, out, of_all.model);
    const double costs = foretold - squares_of(records[out], of_all.model);
    EXPECT_GT(costs, 0);
    EXPECT_NEAR(squares_of(records[out], judging[out]), foretold, part * costs) << out;
    EXPECT_EQ(judging[out].at(2).value, judging[out].at(1).value) << "a tie";
  }
}

TEST(JudgedInTurn, LeavesWhatTheOtherRecordsForetellWrongly) {
  const Model model = noisy_servo();
  expect_as_foretold(records_of(std::array{synthetic::steps, there_and_back, synthetic::steps}, {}, model), model, 0.1);
}

TEST(JudgedInTurn, HoldsWhereOneRecordIsOfAnotherMachine) {
  const Model model = noisy_servo();
  Truth other;
  other.J *= 1.3;
  other.R_a *= 1.15;
  expect_as_foretold(records_of(std::array{synthetic::steps, there_and_back, synthetic::steps}, other, model), model,
                     0.2);
}

TEST(JudgedInTurn, DoesNotBlameARecordForWhatItAloneTells) {
  const Model model = noisy_servo();
  const std::vector<Record> records = records_of(std::array{at_rest, at_rest, synthetic::steps}, {}, model);
  const Fit of_all = calibrate(records, model, plain);
  const double fitted = squares_of(records[2], of_all.model);
  const double judged = squares_of(records[2], judged_in_turn(records, of_all, plain)[2]);
  const double as_given = squares_of(records[2], model);  // what records of a shaft at rest leave of it
  EXPECT_NEAR(judged, fitted, 0.02 * fitted);
  EXPECT_GT(as_given, 10 * fitted);
}

}  // namespace
}  // namespace emtb
