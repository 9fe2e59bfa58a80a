#include "analysis/diagnose/likelihood.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "analysis/numerics/parallel.h"
#include "analysis/numerics/real_transform.h"

namespace emtb {
namespace {

/// The largest number up to n that has no prime factor above five: a transform of others takes long.
std::size_t quick_size(std::size_t n) {
  for (; n > 1; --n) {
    std::size_t rest = n;
    for (const std::size_t prime : {2U, 3U, 5U}) {
      while (rest % prime == 0) rest /= prime;
    }
    if (rest == 1) return n;
  }
  return n;
}

/// The spectrum of a first-order autoregression of variance 1.
/// @param cosine of the frequency
double autoregression(double a, double cosine) { return (1 - a * a) / (1 - 2 * a * cosine + a * a); }

}  // namespace

void ResidualSpectrum::add(std::span<const double> residual, double interval) {
  constexpr double width = 1.25;  // of a bin: its ends as a ratio
  const std::size_t n = quick_size(residual.size());
  if (n < 4) return;
  RealTransform transforms;
  const std::span<const std::complex<double>> transform =
      transforms.of({residual.begin(), residual.begin() + static_cast<std::ptrdiff_t>(n)});
  readings_ += static_cast<double>(n);
  const std::size_t last = n / 2;
  for (std::size_t from = 0; from <= last;) {
    const std::size_t to =
        from == 0 ? 1
                  : std::min(last + 1, std::max(from + 1, static_cast<std::size_t>(width * static_cast<double>(from))));
    Bin bin{0, 0, 0, interval};
    for (std::size_t k = from; k < to; ++k) {
      const double freedom = k == 0 || 2 * k == n ? 1 : 2;
      bin.power += freedom * std::norm(transform[k]) / static_cast<double>(n);
      bin.cosine += freedom * std::cos(2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(n));
      bin.freedom += freedom;
    }
    bin.power /= bin.freedom;
    bin.cosine /= bin.freedom;
    bins_.push_back(bin);
    from = to;
  }
}

ResidualSpectrum& ResidualSpectrum::operator+=(const ResidualSpectrum& other) {
  bins_.insert(bins_.end(), other.bins_.begin(), other.bins_.end());
  readings_ += other.readings_;
  return *this;
}

double ResidualSpectrum::expected(const Bin& bin, const Discrepancy& error) const {
  const double noise = autoregression(autocorrelation_, bin.cosine);
  return error.variance > 0 ? noise + error.variance * autoregression(std::exp(-bin.interval / error.time), bin.cosine)
                            : noise;
}

double ResidualSpectrum::log_likelihood(const Discrepancy& error) const {
  double sum = 0;
  for (const Bin& bin : bins_) {
    const double s = expected(bin, error);
    sum -= 0.5 * bin.freedom * (std::log(s) + bin.power / s);
  }
  return sum;
}

Discrepancy ResidualSpectrum::fitted() const {
  constexpr double clear = 2;  // nats: two numbers are had for it
  if (bins_.empty()) return {};
  double power = 0, freedom = 0, interval = bins_.front().interval;
  for (const Bin& bin : bins_) power += bin.freedom * bin.power, freedom += bin.freedom;
  const double duration = readings_ * interval;
  Discrepancy best;
  double most = log_likelihood({}) + clear;
  const auto look_at = [&](double variance, double time) {
    const double likelihood = log_likelihood({variance, time});
    if (!(likelihood > most)) return;
    most = likelihood;
    best = {variance, time};
  };
  const double largest = 4 * std::max(1.0, power / freedom);
  for (double time = interval / 2; time < duration; time *= 2) {
    for (double variance = largest; variance > 1e-3; variance /= 2) look_at(variance, time);
  }
  if (best.variance == 0) return best;
  for (double step = std::numbers::sqrt2; step > 1.05; step = std::sqrt(step)) {
    for (int again = 0; again < 2; ++again) {
      const Discrepancy from = best;
      look_at(from.variance * step, from.time);
      look_at(from.variance / step, from.time);
      look_at(best.variance, best.time * step);
      look_at(best.variance, best.time / step);
    }
  }
  return best;
}

void add_spectrum(ResidualSpectra& spectra, const Record& record, const Residuals& r) {
  const Observation& o = *record.find(r.signal);
  if (o.size() < 4) return;
  ResidualSpectrum& spectrum = spectra.try_emplace(r.signal, o.autocorrelation).first->second;
  spectrum.add({r.value.data(), static_cast<std::size_t>(r.value.size())}, record.interval_of(o));
}

ResidualSpectra spectra_of(std::span<const Record> records, std::span<const Residuals> residuals) {
  std::vector<ResidualSpectra> each(residuals.size());
  parallel_for(
      residuals.size(), [&](std::size_t i) { add_spectrum(each[i], records[residuals[i].record], residuals[i]); },
      [&](std::size_t i) { return residuals[i].value.size(); });
  ResidualSpectra spectra;
  for (const ResidualSpectra& of_one : each) {
    for (const auto& [signal, spectrum] : of_one) {
      const auto [known, is_new] = spectra.try_emplace(signal, spectrum);
      if (!is_new) known->second += spectrum;
    }
  }
  return spectra;
}

void add_squares(Squares& sums, const Record& record, const Residuals& r) {
  const Observation& o = *record.find(r.signal);
  if (o.size() < 2) return;
  SignalSquares& sum = sums[r.signal];
  const double n = static_cast<double>(o.size());
  sum.interval = (sum.interval * sum.readings + record.interval_of(o) * n) / (sum.readings + n);
  sum.squares += r.value.squaredNorm();
  sum.readings += n;
  sum.autocorrelation = o.autocorrelation;
}

Squares squares_of(std::span<const Record> records, std::span<const Residuals> residuals) {
  Squares sums;
  for (const Residuals& r : residuals) add_squares(sums, records[r.record], r);
  return sums;
}

Memories memory_of(const ResidualSpectra& spectra) {
  Memories memory;
  for (const auto& [signal, spectrum] : spectra) memory.emplace(signal, spectrum.fitted().time);
  return memory;
}

double longest(const Memories& memory) {
  double most = 0;
  for (const auto& [signal, time] : memory) most = std::max(most, time);
  return most;
}

namespace {

/// Of a signal, and of how many readings beside each other one tells as much as all.
struct Counted {
  double readings = 0, kappa = 1, mean_square = 1;
};

Counted counted(const SignalSquares& left, double memory) {
  const double rho = std::clamp(left.autocorrelation, 0.0, 0.99), coloured = (1 + rho) / (1 - rho);
  return {left.readings / coloured, std::max(1.0, 2 * memory / (left.interval * coloured)),
          std::max(1.0, left.squares / left.readings)};
}

double independent(const SignalSquares& left, double memory) {
  const auto [n, kappa, m] = counted(left, memory);
  return n * m / (1 + kappa * (m - 1));
}

/// None where a signal was not among those that told.
double of(Signal signal, const Memories& memory) {
  const auto own = memory.find(signal);
  return own != memory.end() ? own->second : 0;
}

}  // namespace

double log_likelihood(const SignalSquares& left, double memory) {
  const auto [n, kappa, m] = counted(left, memory);
  return -0.5 * (n / kappa) * std::log1p(kappa * (m - 1));
}

double Quality::nats(const Memories& of_error) const {
  double sum = 0, readings = 0;
  for (const auto& [signal, left] : training) {
    sum += log_likelihood(left, of(signal, of_error));
    readings += independent(left, of(signal, of_error));
  }
  for (const auto& [signal, left] : held_out) sum += log_likelihood(left, of(signal, of_error));
  return sum - 0.5 * static_cast<double>(free_parameters) * std::log(std::max(1.0, readings));
}

namespace {

/// By how much the mean square of a signal is above its floor in the training runs.
double excess(const Quality& quality, Signal signal) {
  const auto own = quality.training.find(signal);
  return own != quality.training.end() ? std::max(0.0, own->second.squares / own->second.readings - 1) : 0;
}

/// The memories at which two models are compared: of the better one, since what the other lacks has one of its own.
/// What is missing shows in several signals, so that the longest is that of all which it leaves something of. A signal
/// of which it leaves next to nothing has that of next to nothing.
Memories memories_between(const Quality& without, const Quality& with) {
  constexpr double next_to_nothing = 0.1;  // of what the other leaves; by hand
  const auto tells = [&](Signal signal) { return excess(with, signal) > next_to_nothing * excess(without, signal); };
  double most = 0;
  for (const auto& [signal, time] : with.memory) {
    if (tells(signal)) most = std::max(most, time);
  }
  Memories between;
  for (const auto& [signal, time] : with.memory)
    between.emplace(signal, tells(signal) ? most : std::min(time, of(signal, without.memory)));
  return between;
}

}  // namespace

double gain(const Quality& without, const Quality& with) {
  const Memories memory = memories_between(without, with);
  return with.nats(memory) - without.nats(memory);
}

}  // namespace emtb
