// The ways to get sensitivities, on one run of 100,000 steps of one model: base, Coulomb friction and windage;
// derivatives with respect to R_a, K_b = K_m, B, J, T_c and c_w. docs/decisions/sensitivities.md says what came of it.
//
//     build/release/bin/sensitivities_benchmark
//
// Columns: `step` ns a step of the run for all six derivatives, `each` the same per derivative; `error`, the largest
// error of the derivative of any reading of omega relative to the largest one, against differences in long double: at a
// typical friction (through stick and slip), and at its null.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "model/catalogue.h"
#include "model/simulation.h"
#include "tests/benchmark/hand_written.h"
#include "tests/benchmark/lanes.h"
#include "tests/model/plain_machine.h"

namespace emtb {
namespace {

constexpr std::size_t derivatives = 6;
constexpr std::size_t run_length = 100'001;

using Six = std::array<double, derivatives>;  // R_a, K, B, J, T_c, c_w
constexpr Six typical{1.2, 0.042, 1e-5, 6e-5, 0.003, 2e-8};
constexpr Six without_friction{1.2, 0.042, 1e-5, 6e-5, 0, 2e-8};
constexpr DriverModel driver{.gain = 4, .rise = 2000, .fall = 2000, .min = -24, .max = 24};

/// Steps of a second in both directions, full speed and crawl, one too small to move the shaft. Never to rest without
/// friction: how long a shaft takes to stop has no derivative with respect to a friction that is not there.
const Excitation& excitation() {
  static const Excitation x = [] {
    Excitation e;
    constexpr std::array plan{2.1, -3.3, 6.5, 0.11, -0.3, 0.07, 1.0, 0.02};
    for (std::size_t k = 0; k < run_length; ++k) {
      e.t.push_back(1e-3 * static_cast<double>(k));
      e.u_ref.push_back(plan[k / 1000 % plan.size()]);
    }
    return e;
  }();
  return x;
}

template <class Scalar>
PlainParameters<Scalar> plain(const std::array<Scalar, derivatives>& p) {
  PlainParameters<Scalar> q;
  q.R_a = p[0];
  q.K_b = q.K_m = p[1];
  q.B = p[2];
  q.J = p[3];
  q.T_c = p[4];
  q.c_w = p[5];
  return q;
}

/// d omega/d parameter: one column a parameter.
using Columns = std::array<std::vector<double>, derivatives>;

Columns empty_columns() {
  Columns columns;
  for (auto& c : columns) c.resize(run_length);
  return columns;
}

/// Differences in long double, extrapolated: right to 1e-9 or better.
Columns reference(const Six& at) {
  Columns columns = empty_columns();
  std::vector<long double> y(run_length);
  for (std::size_t j = 0; j < derivatives; ++j) {
    const long double step = 1e-7L * static_cast<long double>(typical[j]);
    const bool one_sided = at[j] == 0;
    std::vector<long double> sum(run_length, 0.0L);
    const auto add = [&](long double where, long double weight) {
      std::array<long double, derivatives> p;
      std::ranges::copy(at, p.begin());
      p[j] += where * step;
      run_plain<long double>(driver, plain(p), excitation(),
                             [&](std::size_t k, const auto& m) { sum[k] += weight * m.omega / step; });
    };
    if (one_sided) {
      add(0, -1.5L), add(1, 2), add(2, -0.5L);
    } else {
      add(-1, -0.5L), add(1, 0.5L);
    }
    for (std::size_t k = 0; k < run_length; ++k) columns[j][k] = static_cast<double>(sum[k]);
  }
  return columns;
}

double error(const Columns& columns, const Columns& right) {
  double worst = 0;
  for (std::size_t j = 0; j < derivatives; ++j) {
    double difference = 0, largest = 0;
    for (std::size_t k = 0; k < run_length; ++k) {
      difference = std::max(difference, std::abs(columns[j][k] - right[j][k]));
      largest = std::max(largest, std::abs(right[j][k]));
    }
    worst = std::max(worst, difference / largest);
  }
  return worst;
}

/// Times one way: @param way fills the columns at given parameters.
template <class Way>
void measure(benchmark::State& state, const Way& way) {
  Columns columns = empty_columns();
  for (auto _ : state) {
    way(typical, columns);
    benchmark::DoNotOptimize(columns);
  }
  const auto per_step = [&](double parts) {
    return benchmark::Counter(static_cast<double>(run_length) * parts,
                              benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  };
  state.counters["step"] = per_step(1);
  state.counters["each"] = per_step(derivatives);
  static const Columns right = reference(typical), right_without = reference(without_friction);
  state.counters["error"] = error(columns, right);
  way(without_friction, columns);
  state.counters["error_at_null"] = error(columns, right_without);
}

void no_derivatives(benchmark::State& state) {
  std::vector<double> omega(run_length);
  for (auto _ : state) {
    run_plain<double>(driver, plain(typical), excitation(), [&](std::size_t k, const auto& m) { omega[k] = m.omega; });
    benchmark::DoNotOptimize(omega);
  }
  state.counters["step"] = benchmark::Counter(
      static_cast<double>(run_length), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

template <std::size_t N>
void dual_numbers(benchmark::State& state) {
  measure(state, [](const Six& at, Columns& columns) {
    for (std::size_t first = 0; first < derivatives; first += N) {
      const std::size_t count = std::min(N, derivatives - first);
      std::array<Dual<N>, derivatives> p;
      for (std::size_t j = 0; j < derivatives; ++j) p[j] = Dual<N>(at[j]);
      for (std::size_t j = 0; j < count; ++j) p[first + j].d[j] = 1;
      run_plain<Dual<N>>(driver, plain(p), excitation(), [&](std::size_t k, const auto& m) {
        for (std::size_t j = 0; j < count; ++j) columns[first + j][k] = m.omega.d[j];
      });
    }
  });
}

/// Simulations with perturbed parameters side by side: base and six in one pass.
template <std::size_t W>
void forward_lanes(benchmark::State& state) {
  measure(state, [](const Six& at, Columns& columns) {
    for (std::size_t first = 0; first < derivatives; first += W - 1) {
      const std::size_t count = std::min(W - 1, derivatives - first);
      std::array<Lanes<W>, derivatives> p;
      Six step;
      for (std::size_t j = 0; j < derivatives; ++j) {
        p[j] = Lanes<W>(at[j]);
        step[j] = 1e-7 * typical[j];
      }
      for (std::size_t j = 0; j < count; ++j) p[first + j][j + 1] += step[first + j];
      run_plain<Lanes<W>>(driver, plain(p), excitation(), [&](std::size_t k, const auto& m) {
        for (std::size_t j = 0; j < count; ++j) columns[first + j][k] = (m.omega[j + 1] - m.omega[0]) / step[first + j];
      });
    }
  });
}

/// Two lanes a parameter. At a bound the lower one would leave it: friction that pushes.
template <std::size_t W>
void central_lanes(benchmark::State& state) {
  measure(state, [](const Six& at, Columns& columns) {
    for (std::size_t first = 0; first < derivatives; first += W / 2) {
      const std::size_t count = std::min(W / 2, derivatives - first);
      std::array<Lanes<W>, derivatives> p;
      Six step;
      for (std::size_t j = 0; j < derivatives; ++j) {
        p[j] = Lanes<W>(at[j]);
        step[j] = 1e-5 * typical[j];
      }
      for (std::size_t j = 0; j < count; ++j) {
        p[first + j][2 * j] += step[first + j];
        p[first + j][2 * j + 1] -= step[first + j];
      }
      run_plain<Lanes<W>>(driver, plain(p), excitation(), [&](std::size_t k, const auto& m) {
        for (std::size_t j = 0; j < count; ++j) {
          columns[first + j][k] = (m.omega[2 * j] - m.omega[2 * j + 1]) / (2 * step[first + j]);
        }
      });
    }
  });
}

void hand_written(benchmark::State& state) {
  measure(state, [](const Six& at, Columns& columns) {
    run_hand_written(driver, at, excitation(), [&](std::size_t k, const HandWritten& m) {
      for (std::size_t j = 0; j < derivatives; ++j) columns[j][k] = m.d_omega[j];
    });
  });
}

/// What emtb runs: model/step.h with the effects of the catalogue.
ModelStructure structure() {
  ModelStructure s;
  s.driver = driver;
  s.effects = {effect_index("coulomb_friction"), effect_index("windage")};
  return s;
}

void the_model_without_derivatives(benchmark::State& state) {
  const ModelStructure s = structure();
  const std::vector<double> p{typical[0], typical[1], typical[1], typical[2], typical[3], typical[4], typical[5]};
  Trajectory<double> y;
  for (auto _ : state) {
    simulate<double>(s, p, excitation(), y);
    benchmark::DoNotOptimize(y);
  }
  state.counters["step"] = benchmark::Counter(
      static_cast<double>(run_length), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

/// Takes the derivatives of omega as they come, as analysis/fit/residuals.cpp does.
template <std::size_t N>
struct TakeDerivatives final : Reader<Dual<N>> {
  TakeDerivatives(Columns& c, std::size_t f, std::size_t n) : columns(c), first(f), count(n) {}
  void read(std::size_t k, const SimulatedReadings<Dual<N>>& y) override {
    for (std::size_t j = 0; j < count; ++j) columns[first + j][k] = y.omega.d[j];
  }
  Columns& columns;
  std::size_t first, count;
};

template <std::size_t N>
void the_model(benchmark::State& state) {
  const ModelStructure s = structure();
  measure(state, [&](const Six& at, Columns& columns) {
    const std::vector<double> values{at[0], at[1], at[1], at[2], at[3], at[4], at[5]};
    constexpr std::array<std::array<std::size_t, 2>, derivatives> moved{
        {{0, 0}, {1, 2}, {3, 3}, {4, 4}, {5, 5}, {6, 6}}};
    for (std::size_t first = 0; first < derivatives; first += N) {
      const std::size_t count = std::min(N, derivatives - first);
      std::vector<Dual<N>> p(values.begin(), values.end());
      for (std::size_t j = 0; j < count; ++j) {
        for (const std::size_t place : moved[first + j]) p[place].d[j] = 1;
      }
      TakeDerivatives<N> take(columns, first, count);
      simulate<Dual<N>>(s, p, excitation(), take);
    }
  });
}

BENCHMARK(no_derivatives)->Unit(benchmark::kMillisecond);
BENCHMARK(dual_numbers<2>)->Unit(benchmark::kMillisecond);
BENCHMARK(dual_numbers<4>)->Unit(benchmark::kMillisecond);
BENCHMARK(dual_numbers<8>)->Unit(benchmark::kMillisecond);
BENCHMARK(forward_lanes<4>)->Unit(benchmark::kMillisecond);
BENCHMARK(forward_lanes<8>)->Unit(benchmark::kMillisecond);
BENCHMARK(central_lanes<4>)->Unit(benchmark::kMillisecond);
BENCHMARK(central_lanes<8>)->Unit(benchmark::kMillisecond);
BENCHMARK(hand_written)->Unit(benchmark::kMillisecond);
BENCHMARK(the_model_without_derivatives)->Unit(benchmark::kMillisecond);
BENCHMARK(the_model<4>)->Unit(benchmark::kMillisecond);
BENCHMARK(the_model<8>)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace emtb
