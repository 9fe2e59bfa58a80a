// What a formula of the user costs in a simulation, beside the same effect of the library: ns a step. Measured on
// request; docs/decisions/formulas.md quotes it.
#include <benchmark/benchmark.h>

#include <string>
#include <vector>

#include "config/formula.h"
#include "model/catalogue.h"
#include "tests/model/benches.h"

namespace emtb {
namespace {

struct Machinery {
  ModelStructure structure;
  std::vector<double> values;
};

Machinery bare() {
  const auto bench = testing_benches::fast_bench();
  return {bench.structure, bench.base};
}

Machinery with_brushes() {
  Machinery m = bare();
  m.structure.effects = {effect_index("brush_drop")};
  m.values.insert(m.values.end(), {0.4, 0.02});
  return m;
}

Machinery with_library() {
  Machinery m = bare();
  m.structure.effects = {effect_index("windage")};
  m.values.push_back(2e-8);
  return m;
}

Machinery with_formula(const std::string& text, TermPlace place = TermPlace::torque, double c = 2e-8) {
  Machinery m = bare();
  const std::vector<std::string> symbols{"c"};
  m.structure.terms = {{place, parse_formula(text, symbols), 1}};
  m.values.push_back(c);
  return m;
}

template <class Scalar>
void run(benchmark::State& state, const Machinery& m) {
  struct Last final : Reader<Scalar> {
    void read(std::size_t, const SimulatedReadings<Scalar>& y) override { omega = value_of(y.omega); }
    double omega = 0;
  } last;
  const Excitation x = testing_benches::fast_bench().excitation;
  std::vector<Scalar> p(m.values.begin(), m.values.end());
  if constexpr (!std::is_same_v<Scalar, double>) {
    for (std::size_t i = 0; i < std::min<std::size_t>(p.size(), derivatives_per_pass); ++i)
      p[p.size() - 1 - i].d[i] = 1;
  }
  for (auto _ : state) {
    simulate<Scalar>(m.structure, p, x, last);
    benchmark::DoNotOptimize(last.omega);
  }
  state.counters["ns_a_step"] =
      benchmark::Counter(static_cast<double>(x.t.size()) * 1e-9,
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void simulated(benchmark::State& state, const Machinery& m) { run<double>(state, m); }
void with_derivatives(benchmark::State& state, const Machinery& m) { run<WideSensitive>(state, m); }

constexpr const char* square = "-c*omega*abs(omega)";
constexpr const char* cubic = "-c*omega^3";
constexpr const char* brushes = "-c*tanh(i_a/0.02)";
constexpr const char* bent = "-c*tanh(omega/8)*exp(-t/20)";

BENCHMARK_CAPTURE(simulated, no_effect, bare());
BENCHMARK_CAPTURE(simulated, library_windage, with_library());
BENCHMARK_CAPTURE(simulated, formula_windage, with_formula(square));
BENCHMARK_CAPTURE(simulated, formula_cubic, with_formula(cubic));
BENCHMARK_CAPTURE(simulated, formula_tanh_exp, with_formula(bent));
BENCHMARK_CAPTURE(simulated, library_brush_drop, with_brushes());
BENCHMARK_CAPTURE(simulated, formula_brush_drop, with_formula(brushes, TermPlace::voltage, 0.4));
BENCHMARK_CAPTURE(with_derivatives, no_effect, bare());
BENCHMARK_CAPTURE(with_derivatives, library_windage, with_library());
BENCHMARK_CAPTURE(with_derivatives, formula_windage, with_formula(square));
BENCHMARK_CAPTURE(with_derivatives, formula_cubic, with_formula(cubic));
BENCHMARK_CAPTURE(with_derivatives, formula_tanh_exp, with_formula(bent));
BENCHMARK_CAPTURE(with_derivatives, library_brush_drop, with_brushes());
BENCHMARK_CAPTURE(with_derivatives, formula_brush_drop, with_formula(brushes, TermPlace::voltage, 0.4));

}  // namespace
}  // namespace emtb
