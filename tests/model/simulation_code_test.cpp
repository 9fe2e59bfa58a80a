#include "model/simulation_code.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "hal/error.h"
#include "model/catalogue.h"
#include "tests/model/benches.h"

namespace emtb {
namespace {

template <class Scalar>
struct Kept final : Reader<Scalar> {
  void read(std::size_t, const SimulatedReadings<Scalar>& y) override {
    omega.push_back(y.omega);
    i_a.push_back(y.i_a);
  }
  std::vector<Scalar> omega, i_a;
};

ModelStructure structure() {
  ModelStructure s;
  s.driver = {.gain = 4, .rise = 2000, .fall = 2000, .min = -24, .max = 24};
  for (const char* id : {"armature_inductance", "coulomb_friction", "windage", "cogging", "tacho_lag"}) {
    s.effects.push_back(effect_index(id));
  }
  std::ranges::sort(s.effects);
  return s;
}

std::vector<double> values_of(const ModelStructure& s) {
  std::vector<double> p{1.2, 0.042, 0.042, 1e-5, 6e-5};
  for (const std::size_t e : s.effects) {
    for (const EffectParameter& q : effect_catalogue()[e].parameters()) p.push_back(0.1 * q.typical + 1e-9);
  }
  return p;
}

Excitation steps() {
  Excitation x;
  for (std::size_t k = 0; k < 8000; ++k) {
    x.t.push_back(1e-3 * static_cast<double>(k));
    x.u_ref.push_back(std::vector<double>{2.1, -3.3, 5.5, 0.3}[k / 1000 % 4]);
  }
  return x;
}

template <class Scalar>
Kept<Scalar> run(SimulationCode::Simulate<Scalar> simulate) {
  const ModelStructure s = structure();
  const std::vector<double> values = values_of(s);
  std::vector<Scalar> p(values.begin(), values.end());
  if constexpr (requires(Scalar x) { x.d; }) {
    for (std::size_t j = 0; j < 4; ++j) p[j].d[j] = 1;
  }
  Kept<Scalar> kept;
  simulate(s, p, steps(), kept, {});
  return kept;
}

/// Largest difference of two results over the largest of them.
template <class Number>
double apart(const std::vector<Number>& a, const std::vector<Number>& b, std::size_t derivative) {
  double most = 0, largest = 0;
  const auto pick = [&](const Number& x) {
    if constexpr (requires { x.d; }) {
      return derivative == 0 ? x.v : x.d[derivative - 1];
    } else {
      return x;
    }
  };
  for (std::size_t k = 0; k < a.size(); ++k) {
    most = std::max(most, std::abs(pick(a[k]) - pick(b[k])));
    largest = std::max(largest, std::abs(pick(a[k])));
  }
  return most / largest;
}

TEST(SimulationCode, IsTheSameForEveryProcessorButForRounding) {
#ifndef EMTB_FOR_AVX2
  GTEST_SKIP() << "compiled once";
#else
  if (!has(Processor::avx2)) GTEST_SKIP() << "this machine has no AVX2";
  constexpr double rounding = 1e-9;  // of a product and a sum that AVX2 rounds once, over 8000 steps
  const SimulationCode any = simulation_code_for<Processor::any>(), avx2 = simulation_code_for<Processor::avx2>();
  EXPECT_NE(any.wide, avx2.wide) << "two copies of the code";
  EXPECT_EQ(any.machine_size, avx2.machine_size);
  const auto plain = run<double>(any.plain), quick = run<double>(avx2.plain);
  EXPECT_LT(apart(plain.omega, quick.omega, 0), rounding);
  EXPECT_LT(apart(plain.i_a, quick.i_a, 0), rounding);
  const auto narrow = run<Sensitive>(any.sensitive), narrow_quick = run<Sensitive>(avx2.sensitive);
  const auto wide = run<WideSensitive>(any.wide), wide_quick = run<WideSensitive>(avx2.wide);
  for (std::size_t j = 0; j <= 4; ++j) {
    EXPECT_LT(apart(narrow.omega, narrow_quick.omega, j), rounding) << j;
    EXPECT_LT(apart(wide.omega, wide_quick.omega, j), rounding) << j;
    EXPECT_LT(apart(wide.i_a, wide_quick.i_a, j), rounding) << j;
  }
#endif
}

class WishedProcessor : public testing::Test {
 protected:
  void wish(const char* name) { setenv("EMTB_SIMD", name, 1); }
  void SetUp() override {
    if (const char* before = std::getenv("EMTB_SIMD")) before_ = before;
  }
  void TearDown() override { before_.empty() ? unsetenv("EMTB_SIMD") : setenv("EMTB_SIMD", before_.c_str(), 1); }

 private:
  std::string before_;
};

TEST_F(WishedProcessor, IsTakenWhereItIsThere) {
  wish("baseline");
  EXPECT_EQ(processor(), Processor::any);
  wish("");
  EXPECT_EQ(processor(), has(Processor::avx2) ? Processor::avx2 : Processor::any);
  wish("avx2");
  if (has(Processor::avx2)) {
    EXPECT_EQ(processor(), Processor::avx2);
  } else {
    EXPECT_THROW(processor(), ModelError);
  }
}

TEST_F(WishedProcessor, ThatIsNoneIsToldInALine) {
  wish("sse9");
  try {
    processor();
    FAIL() << "takes any name";
  } catch (const ModelError& e) {
    EXPECT_STREQ(e.what(), "EMTB_SIMD is `sse9`. Write `baseline` or `avx2`, or leave it out.");
  }
}

}  // namespace
}  // namespace emtb
