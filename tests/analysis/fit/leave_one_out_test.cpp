#include "analysis/fit/leave_one_out.h"

#include <gtest/gtest.h>

#include "analysis/record/dataset.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using synthetic::servo_model;
using synthetic::Truth;

constexpr synthetic::Sigma noisy{.omega = 0.1, .i_a = 0.01, .e_a = 0.02};
const std::vector<synthetic::Hold> there_and_back{{0.2, 0}, {0.5, -2}, {0.3, 4}, {0.5, 1}, {0.3, 0}};
const CalibrationOptions plain{.extra_starts = 0, .max_iterations = 60, .tolerance = 1e-9, .with_covariance = false};

Model noisy_servo() {
  Model model = servo_model();
  model.noise = {{Signal::omega, noisy.omega}, {Signal::i_a, noisy.i_a}, {Signal::e_a, noisy.e_a}};
  return model;
}

std::vector<Record> three_runs(const Truth& of_the_last, const Model& model) {
  const std::vector<emtb::Run> runs{synthetic::record({}, synthetic::steps, 1e-3, noisy),
                                    synthetic::record({}, there_and_back, 1e-3, noisy),
                                    synthetic::record(of_the_last, synthetic::steps, 1e-3, noisy)};
  return prepare(runs, {}, model).train;
}

double squares_of(const Record& record, const Model& model) {
  return sum_of_squares(residuals(std::span(&record, 1), model, model.values(), {}));
}

/// What each of the models leaves of its record, beside what a fit of the others leaves, in parts of what it costs to
/// leave the record out.
void expect_as_fitted_anew(const std::vector<Record>& records, const Model& model, double part) {
  const Fit of_all = calibrate(records, model, plain);
  const std::vector<Model> without = fits_without_each(records, of_all, plain);
  ASSERT_EQ(without.size(), records.size());
  for (std::size_t out = 0; out < records.size(); ++out) {
    std::vector<Record> others = records;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(out));
    const double anew = squares_of(records[out], calibrate(others, of_all.model, plain).model);
    const double costs = anew - squares_of(records[out], of_all.model);
    EXPECT_GT(costs, 0);
    EXPECT_NEAR(squares_of(records[out], without[out]), anew, part * costs) << out;
    EXPECT_EQ(without[out].at(2).value, without[out].at(1).value) << "a tie";
  }
}

TEST(FitsWithoutEach, AreThoseOfTheOtherRecords) {
  const Model model = noisy_servo();
  expect_as_fitted_anew(three_runs({}, model), model, 0.05);
}

TEST(FitsWithoutEach, HoldWhereOneRecordIsOfAnotherMachine) {
  const Model model = noisy_servo();
  Truth other;
  other.J *= 1.6;
  other.R_a *= 1.3;
  expect_as_fitted_anew(three_runs(other, model), model, 0.1);
}

}  // namespace
}  // namespace emtb
