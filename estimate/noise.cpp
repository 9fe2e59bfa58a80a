#include "estimate/noise.h"

#include <algorithm>
#include <cmath>

#include "estimate/orders.h"

namespace emtb {
namespace {

constexpr double settled_stretch = 1.0;  ///< [s] shortest stretch that tells a scatter
constexpr std::size_t fewest_readings = 5;

double median(std::vector<double> x) {
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::ranges::nth_element(x, middle);
  return *middle;
}

/// Scatter about a straight line: variance, covariance of neighbours, and how far the line rises in units of its error.
struct Scatter {
  double variance = 0, covariance = 0, rise = 0;
};

Scatter scatter_about_line(std::span<const double> y) {
  const auto n = static_cast<double>(y.size());
  const double middle = (n - 1) / 2;
  double mean = 0, slope = 0;
  for (std::size_t i = 0; i < y.size(); ++i) mean += y[i] / n;
  const double spread = n * (n * n - 1) / 12;
  for (std::size_t i = 0; i < y.size(); ++i) slope += (static_cast<double>(i) - middle) * (y[i] - mean) / spread;
  double squares = 0, products = 0, before = 0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double r = y[i] - mean - slope * (static_cast<double>(i) - middle);
    squares += r * r;
    if (i > 0) products += r * before;
    before = r;
  }
  const double variance = squares / (n - 2);
  return {variance, products / (n - 2), std::abs(slope) * n / std::sqrt(std::max(variance, 1e-300))};
}

/// Half-open stretches of the grid over which the input does not change, for 1 s or more.
std::vector<std::pair<std::size_t, std::size_t>> constant_stretches(const Excitation& x,
                                                                    const std::vector<double>& input) {
  std::vector<std::pair<std::size_t, std::size_t>> stretches;
  const double tolerance = 6 * difference_scatter(input);
  std::size_t begin = 0;
  for (std::size_t k = 1; k <= input.size(); ++k) {
    if (k < input.size() && std::abs(input[k] - input[begin]) <= tolerance) continue;
    if (x.t[k - 1] - x.t[begin] >= settled_stretch) stretches.emplace_back(begin, k);
    begin = k;
  }
  return stretches;
}

/// The pieces of a signal in which nothing changes but noise, and what repeats with the angle.
struct Settled {
  std::vector<TurningStretch> fast;
  std::vector<std::vector<double>> slow;
};

/// Collects the settled pieces of one observation.
void collect(const PreparedRun& record, const Observation& o, Settled& settled) {
  const Excitation& x = record.excitation;
  const std::vector<double>& input = !x.u_ref.empty() ? x.u_ref : !x.e_a.empty() ? x.e_a : x.i_a;
  for (const auto& [begin, end] : constant_stretches(x, input)) {
    // The later half: the machine has had its time to settle. A slow meter is taken whole, a fast signal in pieces of 1
    // s.
    const double from = 0.5 * (x.t[begin] + x.t[end - 1]), until = x.t[end - 1];
    TurningStretch piece;
    double piece_begin = from;
    const auto take = [&] {
      if (piece.value.size() < fewest_readings) return;
      if (o.slow) {
        settled.slow.push_back(piece.value);
      } else if (scatter_about_line(piece.value).rise <= 4) {  // else still moving: curvature would count as noise
        settled.fast.push_back(piece);
      }
    };
    for (std::size_t i = 0; i < o.size(); ++i) {
      const double t = x.t[o.last[i]];
      if (x.t[o.first[i]] < from || t > until) continue;
      if (!o.slow && t - piece_begin >= settled_stretch) {
        take();
        piece = {};
        piece_begin = t;
      }
      piece.value.push_back(o.value[i]);
      piece.angle.push_back(x.angle.empty() ? 0 : x.angle[o.last[i]]);
    }
    if (o.slow || until - piece_begin >= 0.9 * settled_stretch) take();
  }
}

/// Scatter by third differences, which a smooth movement of the signal leaves out: 1.4826 median|d3 x| / sqrt 20.
double third_difference_scatter(std::span<const double> x) {
  std::vector<double> differences;
  for (std::size_t k = 3; k < x.size(); ++k)
    differences.push_back(std::abs(x[k] - 3 * x[k - 1] + 3 * x[k - 2] - x[k - 3]));
  return differences.empty() ? 0 : 1.4826 * median(std::move(differences)) / std::sqrt(20.0);
}

NoiseFloor floor_of(Signal signal, std::span<const PreparedRun> records) {
  NoiseFloor floor;
  Settled settled;
  std::vector<double> differences;
  double lsb = 0;
  for (const PreparedRun& record : records) {
    for (const Observation& o : record.observations) {
      if (o.signal != signal) continue;
      collect(record, o, settled);
      differences.push_back(third_difference_scatter(o.value));
      lsb = std::max(lsb, o.lsb);
    }
  }
  // What repeats with the angle is no noise: an effect may explain it.
  const std::vector<Order> orders = strong_orders(settled.fast, 4);
  std::vector<double> variances, correlations;
  const auto take = [&](std::span<const double> piece) {
    const Scatter s = scatter_about_line(piece);
    variances.push_back(s.variance);
    if (s.variance > 0) correlations.push_back(s.covariance / s.variance);
  };
  for (TurningStretch& piece : settled.fast) {
    if (piece.value.size() > 20 * orders.size()) remove_orders(piece, orders);
    take(piece.value);
  }
  for (const auto& piece : settled.slow) take(piece);
  if (variances.size() >= 2) {
    const double variance = median(variances);
    floor.sigma = std::sqrt(variance);
    floor.from = "settled";
    if (!correlations.empty()) floor.autocorrelation = std::clamp(median(correlations), -0.99, 0.999);
  } else {
    floor.sigma = median(differences);
    floor.from = "differences";
    floor.lower_bound = true;
  }
  if (const double resolution = lsb / std::sqrt(12.0); floor.sigma < resolution) {
    floor.sigma = resolution;
    floor.from = "resolution";
    floor.lower_bound = false;
  }
  return floor;
}

}  // namespace

double difference_scatter(std::span<const double> x) {
  if (x.size() < 2) return 0;
  std::vector<double> differences;
  differences.reserve(x.size());
  double squares = 0;
  for (std::size_t k = 1; k < x.size(); ++k) {
    differences.push_back(std::abs(x[k] - x[k - 1]));
    squares += differences.back() * differences.back();
  }
  const double robust = 1.4826 * median(differences) / std::sqrt(2.0);
  if (robust > 0) return robust;
  // A coarse grid: most readings repeat. A constant (the reference itself) has edges only, and they are not noise.
  const auto changes = static_cast<double>(std::ranges::count_if(differences, [](double d) { return d > 0; }));
  const bool steps_only = changes < 0.05 * static_cast<double>(differences.size());
  return steps_only ? 0 : std::sqrt(squares / static_cast<double>(differences.size()) / 2);
}

Noise estimate_noise(std::span<const PreparedRun> records, const Model& model) {
  Noise noise;
  for (const PreparedRun& record : records) {
    for (const Observation& o : record.observations) {
      if (noise.contains(o.signal)) continue;
      NoiseFloor floor = floor_of(o.signal, records);
      if (const auto declared = model.noise.find(o.signal); declared != model.noise.end()) {
        floor.sigma = std::max(declared->second, o.lsb / std::sqrt(12.0));
        floor.from = "declared";
        floor.lower_bound = false;
      }
      if (floor.sigma <= 0) floor.sigma = 1e-9;  // a signal without any scatter at all: nothing to weigh by
      noise[o.signal] = floor;
    }
  }
  return noise;
}

void weigh(std::span<PreparedRun> records, const Noise& noise, const Model& model) {
  const std::vector<double> values = model.values();
  const double resistance = values[0];
  for (PreparedRun& record : records) {
    const Excitation& x = record.excitation;
    Trajectory<double> driver;
    if (!x.u_ref.empty()) {
      ModelStructure structure = model.structure();
      structure.measured_voltage = false;
      simulate<double>(structure, values, x, driver);
    }
    for (Observation& o : record.observations) {
      const double floor = noise.at(o.signal).sigma;
      o.sigma.assign(o.size(), floor);
      for (std::size_t i = 0; i < o.size(); ++i) {
        double widened = floor * floor;
        const std::size_t k = o.last[i];
        if (o.signal == Signal::e_a && !driver.e_a.empty()) {
          // Half a sample of timing error on an edge looks like an output resistance, a delay or a lag.
          const std::size_t before = k > 0 ? k - 1 : k, after = std::min(k + 1, x.t.size() - 1);
          const double change =
              std::max(std::abs(driver.e_a[after] - driver.e_a[k]), std::abs(driver.e_a[k] - driver.e_a[before]));
          widened += change * change;
        }
        if (o.signal == Signal::i_a && !o.slow && !record.voltage_noise.empty()) {
          const double carried = record.voltage_noise[k] / resistance;
          widened += carried * carried;
        }
        o.sigma[i] = std::sqrt(widened);
      }
    }
  }
}

}  // namespace emtb
