// Compiled once for each processor (emtb_for_processors() in cmake/EmtbBuild.cmake), which EMTB_PROCESSOR names.
#include "analysis/fit/summed_pass.h"

#include <cstdint>
#include <type_traits>
#include <utility>

#include "analysis/fit/instrument.h"
#include "model/simulation_loop.h"

#ifndef EMTB_PROCESSOR
#define EMTB_PROCESSOR any
#define EMTB_SUMMED_PASS_CHOICE
#endif

namespace emtb {
namespace {

/// Takes the readings of a simulation and adds what they tell, observation by observation.
template <class Scalar>
class Summing {
 public:
  Summing(const Record& record, const ModelStructure& structure, const std::vector<char>& wanted) {
    for (std::size_t i = 0; i < record.observations.size(); ++i) {
      if (!wanted[i]) continue;
      const Observation& o = record.observations[i];
      Instrument<Scalar> instrument(o, structure);
      if (instrument.at_once()) {
        instant_.push_back(
            {o.simulated(), o.last.data(), o.last.data() + o.last.size(), o.value.data(), o.sigma.data()});
      } else {
        instruments_.push_back(std::move(instrument));
      }
    }
  }

  void read(std::size_t k, const SimulatedReadings<Scalar>& y) {
    for (Instant& o : instant_) {
      for (; o.last != o.end && *o.last == k; ++o.last, ++o.value, ++o.sigma) {
        add(*o.value, y.of(o.signal), 1 / static_cast<double>(*o.sigma));
      }
    }
    for (Instrument<Scalar>& instrument : instruments_) {
      const Observation& o = instrument.observation();
      instrument.see(k, y, [&](std::size_t reading, const Scalar& predicted) {
        add(o.value[reading], predicted, 1 / o.sigma[reading]);
      });
    }
  }

  PassSums sums(std::size_t parameters) {
    PassSums out;
    out.rtr = squares_;
    if constexpr (!std::is_same_v<Scalar, double>) {
      add_waiting();
      for (std::size_t i = 0; i < parameters; ++i) {
        out.str[i] = gradient_[i];
        for (std::size_t j = 0; j < parameters; ++j) out.sts[i * PassSums::most + j] = products_[i][j];
      }
    }
    return out;
  }

 private:
  void add(double measured, const Scalar& predicted, double weight) {
    const double r = (measured - value_of(predicted)) * weight;
    squares_ += r * r;
    if constexpr (!std::is_same_v<Scalar, double>) {
      waiting_[count_] = {predicted.d * weight, r};
      if (++count_ == waiting_.size()) add_waiting();
    }
  }

  /// Many at a time: the sums stay in registers meanwhile.
  void add_waiting() {
    Gradient gradient = gradient_;
    std::array<Gradient, size> products = products_;
    for (std::size_t k = 0; k < count_; ++k) {
      const Gradient& s = waiting_[k].s;
      gradient += s * waiting_[k].r;
      for (std::size_t i = 0; i < size; ++i) products[i] += s * s[i];
    }
    gradient_ = gradient;
    products_ = products;
    count_ = 0;
  }

  struct None {};
  template <class T>
  struct GradientOf {
    using type = None;
    static constexpr std::size_t size = 0;
  };
  template <std::size_t N>
  struct GradientOf<Dual<N>> {
    using type = typename Dual<N>::Gradient;
    static constexpr std::size_t size = N;
  };
  using Gradient = typename GradientOf<Scalar>::type;
  static constexpr std::size_t size = GradientOf<Scalar>::size;
  struct Waiting {
    Gradient s;
    double r;
  };

  /// Most instruments read a value at a time: where in their readings it has come to.
  struct Instant {
    Signal signal;
    const std::uint32_t *last, *end;
    const double* value;
    const float* sigma;
  };
  std::vector<Instant> instant_;
  std::vector<Instrument<Scalar>> instruments_;
  double squares_ = 0;
  Gradient gradient_{};
  std::array<Gradient, size> products_{};
  std::array<Waiting, 64> waiting_{};
  std::size_t count_ = 0;
};

template <class Scalar>
PassSums pass(const Record& record, const ModelStructure& structure, std::span<const double> values,
              std::span<const std::vector<std::size_t>> moved, const std::vector<char>& wanted) {
  std::vector<Scalar> p(values.begin(), values.end());
  if constexpr (!std::is_same_v<Scalar, double>) {
    for (std::size_t j = 0; j < moved.size(); ++j) {
      for (const std::size_t place : moved[j]) p[place].d[j] = 1;
    }
  }
  record.count_simulation(structure, moved.size());
  Summing<Scalar> summing(record, structure, wanted);
  simulate_here<Scalar>(structure, p, record.excitation, summing, {});
  return summing.sums(moved.size());
}

}  // namespace

template <>
PassSums summed_pass_for<Processor::EMTB_PROCESSOR>(const Record& record, const ModelStructure& structure,
                                                    std::span<const double> values,
                                                    std::span<const std::vector<std::size_t>> moved,
                                                    const std::vector<char>& wanted) {
  if (moved.empty()) return pass<double>(record, structure, values, moved, wanted);
  if (moved.size() <= derivatives_per_pass) return pass<Sensitive>(record, structure, values, moved, wanted);
  if (moved.size() <= 2 * derivatives_per_pass) return pass<WideSensitive>(record, structure, values, moved, wanted);
  if (moved.size() <= 3 * derivatives_per_pass)
    return pass<Dual<3 * derivatives_per_pass>>(record, structure, values, moved, wanted);
  return pass<Dual<PassSums::most>>(record, structure, values, moved, wanted);
}

#ifdef EMTB_SUMMED_PASS_CHOICE
PassSums summed_pass(const Record& record, const ModelStructure& structure, std::span<const double> values,
                     std::span<const std::vector<std::size_t>> moved, const std::vector<char>& wanted) {
#ifdef EMTB_FOR_AVX2
  static const bool avx2 = processor() == Processor::avx2;
  if (avx2) return summed_pass_for<Processor::avx2>(record, structure, values, moved, wanted);
#endif
  return summed_pass_for<Processor::any>(record, structure, values, moved, wanted);
}
#endif

}  // namespace emtb
