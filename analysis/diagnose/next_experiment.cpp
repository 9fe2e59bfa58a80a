#include "analysis/diagnose/next_experiment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>

#include "analysis/fit/residuals.h"
#include "analysis/numerics/even_series.h"
#include "analysis/numerics/linear_algebra.h"
#include "analysis/numerics/parallel.h"

namespace emtb {
namespace {

constexpr double coarse_interval = 0.01;  // [s] at least, between the rows of an experiment that lasts minutes
constexpr const char* heat_soak = "heat_soak";
constexpr double share_of_range = 1e-3;  // what an instrument's noise may be where none is known

/// How one signal was read.
struct Instrument {
  Signal signal{};
  double interval = 0;  ///< [s]
  double window = 0;    ///< [s]
  double lsb = 0;
};

std::vector<Instrument> instruments_of(const Run& run) {
  std::vector<Instrument> all;
  for (const auto& [signal, series] : run.signals) {
    constexpr std::array read{Signal::omega, Signal::theta, Signal::i_a, Signal::e_a, Signal::torque};
    if (std::ranges::find(read, signal) == read.end()) continue;
    if (series.t.size() < 2) continue;
    const double interval = mean_interval(series.t);
    const bool slow = is_sparse(run, signal);
    all.push_back({signal, interval, slow && series.window <= 0 ? interval : series.window, series.lsb});
  }
  return all;
}

/// [s] between the rows of a log: an instrument that is read less often is sparse in it.
double row_interval(const Run& run, const std::vector<Instrument>& instruments) {
  double fastest = mean_interval(run.at(Signal::u_ref).t);
  for (const Instrument& i : instruments) fastest = std::min(fastest, i.interval);
  return fastest;
}

struct Experiment {
  Profile profile;
  std::string what;
};

/// What can be run between these references [V].
std::vector<Experiment> menu(double low, double high) {
  const double most = std::max(high, -low);
  std::vector<Experiment> all;
  std::vector<double> levels;
  for (const double share : {0.2, 0.4, 0.6, 0.8, 1.0, 0.7, 0.5, 0.3, 0.1}) levels.push_back(share * high);
  all.push_back({staircase("staircase", levels, 1, 4, 3), "nine levels up and down, 4 s each"});
  all.push_back({ramp("slow_ramp", high, high / 30, 1, 3, 3), "up within 30 s, and down again"});
  all.push_back({step("coast_down", high, 0.5, 6, 12), "a step to the top, held for 6 s, then to 0"});
  std::vector<double> small;
  for (const double share : {0.05, 0.1, 0.15, 0.05, 0.2, 0.02, 0.25}) small.push_back(share * high);
  all.push_back({staircase("small_steps", small, 1, 4, 3), "small steps up to a quarter of the range"});
  all.push_back({random_steps("random_steps", std::min(0.0, low), high, 0.2, 3, 0.5, 40, 3, 1),
                 "random levels over the whole range, 0.2 to 3 s each"});
  if (low < -0.2 * most) {
    const std::array reversing{0.9 * high, 0.9 * low, 0.3 * high, 0.3 * low, 0.6 * high, 0.6 * low};
    all.push_back({staircase("reversal", reversing, 1, 4, 3), "levels of both signs in turn, 4 s each"});
  }
  all.push_back({step(heat_soak, high, 1, 600, 5), "the top, held for ten minutes"});
  return all;
}

/// What of it the bench has the time for, in levels with which the model foresees no run near a limit.
std::vector<Experiment> allowed_menu(double low, double high, const Model& model, const Reach& reach) {
  std::vector<Experiment> allowed;
  for (Experiment& experiment : menu(low, high)) {
    if (experiment.profile.duration() > reach.longest) continue;
    if (auto profile = within_limits(experiment.profile, model, reach.limits)) {
      allowed.push_back({std::move(*profile), std::move(experiment.what)});
    }
  }
  return allowed;
}

/// The mean of a signal over so many rows before row k, or over those that there are.
double mean_before(const std::vector<double>& signal, std::size_t k, std::size_t rows) {
  const std::size_t over = std::min(rows, k);
  if (over == 0) return signal[k];
  double sum = 0.5 * (signal[k - over] + signal[k]);
  for (std::size_t j = k - over + 1; j < k; ++j) sum += signal[j];
  return sum / static_cast<double>(over);
}

/// What the instruments would read of a model. @param fastest [s] between rows
std::optional<Run> simulated(const Profile& profile, const Model& model, const std::vector<Instrument>& instruments,
                             double fastest) {
  if (profile.duration() > 100) fastest = std::max(fastest, coarse_interval);
  const std::optional<Foreseen> foreseen = foresee(model, profile, fastest);
  if (!foreseen) return std::nullopt;
  const auto& [x, y] = *foreseen;
  Run run;
  run.name = profile.name();
  run.signals[Signal::u_ref] = {.t = x.t, .value = x.u_ref, .window = 0, .lsb = 0, .source = {}};
  for (const Instrument& instrument : instruments) {
    const std::vector<double>& signal = y.of(instrument.signal);
    Series series;
    series.window = instrument.window;
    series.lsb = instrument.lsb;
    const auto stride = static_cast<std::size_t>(std::max(1.0, std::round(instrument.interval / fastest)));
    const auto over = static_cast<std::size_t>(std::round(instrument.window / fastest));
    for (std::size_t k = 0; k < signal.size(); k += stride) {
      series.t.push_back(x.t[k]);
      series.value.push_back(mean_before(signal, k, over));
    }
    if (series.t.size() >= 10) run.signals[instrument.signal] = std::move(series);
  }
  return run;
}

/// The noise floors with assumed ones for what was never recorded.
Noise completed(Noise noise, const Run& run) {
  for (const auto& [signal, series] : run.signals) {
    if (signal == Signal::u_ref || noise.contains(signal)) continue;
    double largest = 0;
    for (const double v : series.value) largest = std::max(largest, std::abs(v));
    noise[signal] = {.sigma = std::max(share_of_range * largest, 1e-9),
                     .from = FloorSource::assumed,
                     .lower_bound = false,
                     .autocorrelation = 0};
  }
  return noise;
}

/// What the data at hand say of a model's free parameters.
Eigen::MatrixXd information(std::span<const Record> records, const Model& model) {
  const FreeParameters free(model);
  const auto p = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(p, p);
  for (const Residuals& r : residuals(records, model, model.values(), moved_by(free))) {
    if (r.informed()) sum += gram(r.sensitivity);
  }
  return sum;
}

/// How far a model stays from a run, once its parameters have adapted.
double separation(const Run& run, const Noise& noise, const Eigen::MatrixXd& known, const Model& other) {
  const std::vector<Record> records{prepare_with(noise, run, other)};
  const FreeParameters free(other);
  const std::vector<Residuals> seen = residuals(records, other, other.values(), moved_by(free));
  Eigen::MatrixXd both = known;
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(known.rows());
  for (const Residuals& r : seen) {
    if (!r.informed()) continue;
    both += gram(r.sensitivity);
    gradient += transposed_product(r.sensitivity, r.value);
  }
  const Eigen::VectorXd change = solve_normal(both, gradient);
  double largest = 0;
  for (const Residuals& r : seen) {
    const Eigen::VectorXd left = r.informed() ? Eigen::VectorXd(r.value - product(r.sensitivity, change)) : r.value;
    largest = std::max(largest, left.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, left.size())));
  }
  return std::isfinite(largest) ? std::sqrt(largest) : 0;
}

}  // namespace

std::vector<Proposal> next_experiments(std::span<const Run> runs, const Dataset& data, const Model& one,
                                       std::span<const Model> others, const Reach& reach) {
  if (runs.empty() || others.empty() || one.input != Signal::u_ref || !one.driver) return {};
  double low = reach.low, high = reach.high;
  for (const Run& run : runs) {
    for (const double u : run.at(Signal::u_ref).value) {
      low = std::min(low, u);
      high = std::max(high, u);
    }
  }
  if (high <= 0) return {};
  std::vector<Eigen::MatrixXd> known;
  for (const Model& other : others) known.push_back(information(data.train, other));

  const std::vector<Instrument> own = instruments_of(runs.front());
  const double fastest = row_interval(runs.front(), own);
  std::vector<std::vector<Signal>> additions{{}};
  for (const Signal signal : {Signal::i_a, Signal::e_a}) {
    const auto known_as = std::ranges::find(own, signal, &Instrument::signal);
    if (known_as == own.end() || known_as->window > 0) additions.push_back({signal});
  }
  std::vector<Proposal> proposals;
  for (const Experiment& experiment : allowed_menu(low, high, one, reach)) {
    for (const std::vector<Signal>& added : additions) {
      proposals.push_back({experiment.profile, experiment.what, added, 0});
    }
  }
  parallel_for(proposals.size(), [&](std::size_t i) {
    Proposal& proposal = proposals[i];
    std::vector<Instrument> instruments = own;
    for (const Signal signal : proposal.record) {
      std::erase_if(instruments, [signal](const Instrument& k) { return k.signal == signal; });
      instruments.push_back({signal, fastest, 0, 0});
    }
    Noise noise = data.noise;
    for (const Signal signal : proposal.record) noise.erase(signal);
    const std::optional<Run> run = simulated(proposal.profile, one, instruments, fastest);
    if (!run) return;
    noise = completed(std::move(noise), *run);
    proposal.separation = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < others.size(); ++k) {
      proposal.separation = std::min(proposal.separation, separation(*run, noise, known[k], others[k]));
    }
  });
  // At equal separation, what needs no further instrument.
  std::ranges::stable_sort(proposals, [](const Proposal& a, const Proposal& b) {
    const auto worth = [](const Proposal& p) { return p.separation * (p.record.empty() ? 1.2 : 1.0); };
    return worth(a) > worth(b);
  });
  return proposals;
}

std::vector<Profile> broader_experiments(const Model& model, const Reach& reach) {
  std::vector<Profile> all;
  for (const Experiment& experiment : allowed_menu(reach.low, reach.high, model, reach)) {
    if (experiment.profile.name() != heat_soak) all.push_back(experiment.profile);
  }
  std::ranges::rotate(all, all.begin() + (all.empty() ? 0 : 1));  // the staircase is the menu's first
  return all;
}

std::string in_words(const Proposal& best) {
  if (best.separation < worth_an_experiment) return "Nothing on this bench can tell them apart.";
  std::ostringstream text;
  text << "Run `" << best.profile.name() << "`: " << best.what;
  for (const Signal signal : best.record) text << ", with a fast " << info(signal).column << " recorded beside";
  constexpr double far = 1000;  // floors: a prediction so far from any run is no number to go by
  text.precision(2);
  text << ". It would bring their predictions ";
  if (best.separation < far) {
    text << best.separation << " noise floors apart.";
  } else {
    text << "more than " << static_cast<int>(far) << " noise floors apart.";
  }
  return text.str();
}

}  // namespace emtb
