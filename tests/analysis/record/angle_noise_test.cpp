#include "analysis/record/angle_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "analysis/record/dataset.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

constexpr double one_code = 2 * std::numbers::pi / 4096;

/// Rests for 2 s, turns for 2 s, and rests again, read every 10 ms.
emtb::Run angle_of(double noise, double jitter, double creep = 0) {
  std::mt19937 random(3);
  std::normal_distribution<double> scatter(0, noise * one_code);
  std::uniform_real_distribution<double> late(0, jitter * 0.01);
  emtb::Run run;
  Series& theta = run.signals[Signal::theta];
  for (int k = 0; k < 600; ++k) {
    const double t = 0.01 * k, read = t + late(random);
    const double turned = read < 2 ? 0 : read < 4 ? 8 * (read - 2) * (read - 2) : 32;
    theta.t.push_back(t);
    theta.value.push_back(one_code * std::round((turned + creep * std::sin(40 * read) + scatter(random)) / one_code));
  }
  theta.lsb = one_code;
  return run;
}

double noise_of(const emtb::Run& run) { return scatter_at_rest(std::span(&run, 1)) / one_code; }

TEST(AngleNoise, OfAPotentiometerIsWhatItScattersAtRest) { EXPECT_NEAR(noise_of(angle_of(3, 0)), 3, 0.7); }

TEST(AngleNoise, OfAnEncoderIsNone) {
  EXPECT_EQ(noise_of(angle_of(0, 0)), 0);
  EXPECT_EQ(noise_of(angle_of(0, 0.3)), 0) << "times that jitter are none of the angle's";
  EXPECT_EQ(noise_of(angle_of(0.3, 0)), 0) << "a shaft that rests on the edge of a count";
  EXPECT_EQ(noise_of(angle_of(0, 0, 5 * one_code)), 0) << "nor is a shaft that swings";
}

TEST(AngleNoise, IsNotToldOfAnInstrumentWhoseStepIsNotKnown) {
  emtb::Run run = angle_of(3, 0);
  run.signals.at(Signal::theta).lsb = 0;
  EXPECT_EQ(noise_of(run), 0);
}

TEST(AngleNoise, IsWhatTheModelDeclares) {
  const emtb::Run run = angle_of(0, 0);
  Model model;
  EXPECT_EQ(angle_noise(model, std::span(&run, 1)).still, 0);
  model.noise[Signal::theta] = 3 * one_code;
  EXPECT_EQ(angle_noise(model, std::span(&run, 1)).still, 3 * one_code);
}

TEST(AngleNoise, ThatIsDeclaredSetsTheFloorOfTheSpeedThatTheAngleTells) {
  emtb::Run run = angle_of(0, 0);
  Series& reference = run.signals[Signal::u_ref];
  reference.t = run.at(Signal::theta).t;
  for (const double t : reference.t) reference.value.push_back(t < 2 || t > 4 ? 0 : 1);
  Model model = synthetic::servo_model();
  const double quiet = prepare(std::span(&run, 1), {}, model).noise.at(Signal::omega).sigma;
  model.noise[Signal::theta] = 3 * one_code;
  const double noisy = prepare(std::span(&run, 1), {}, model).noise.at(Signal::omega).sigma;
  EXPECT_GT(noisy, 4 * quiet) << "three steps beside the third of one that counts leave";
}

}  // namespace
}  // namespace emtb
