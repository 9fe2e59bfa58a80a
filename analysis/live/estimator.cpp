#include "analysis/live/estimator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "analysis/live/history.h"
#include "analysis/live/intake.h"
#include "analysis/live/misfit.h"
#include "analysis/live/plan.h"
#include "analysis/live/relinearised_fit.h"

namespace emtb {
namespace {

// By hand, but for the first: estimates ten times a second are asked for.
constexpr double solve_period = 0.1;      ///< [s] between two solutions
constexpr std::size_t errors_every = 10;  ///< solutions between two looks at the standard errors
constexpr double excited_at = 0.01;       ///< part of a variance that the last seconds, once more, would take away
constexpr double settle_first = 0.5;      ///< [s] of data before the values are first moved
constexpr double fewest_ticks = 10;       ///< of a chapter
constexpr double misfits_at = 1.5;        ///< noise floors that are left of a signal; healthy benches: 1.05 at most

/// A step ends on a bound but for rounding. How far apart the bounds are says nothing of what is near to one.
bool rests_at(double bound, double value) {
  constexpr double rounding = 1e-12;
  return std::abs(value - bound) <= rounding * std::abs(bound);
}

}  // namespace

struct LiveEstimator::Impl {
  Impl(const Model& given, std::span<const Channel> channels, double rate, const Options& given_options);

  void take(Signal signal, double t, double value) {
    if (intake.take(signal, t, value)) work();
  }
  void work();
  void follow();
  void solve();
  void begin_chapter();
  std::vector<NoiseColour> noise_floors() const;
  std::vector<LiveParameter> parameters() const;
  std::map<Signal, double> states() const;
  std::map<Signal, double> left() const;
  std::vector<LiveInnovation> innovations() const;

  std::vector<std::string> left_out;
  const Model model;  ///< less what is left out
  const FreeParameters free;
  const Options options;
  const LivePlan plan;
  const std::size_t solve_every;  ///< ticks

  LiveHistory history;
  LiveIntake intake;
  RelinearisedFit fit;
  std::unique_ptr<LiveMisfit> misfit;  ///< null: not wanted
  std::size_t since_solved = 0, since_errors = 0;
};

LiveEstimator::Impl::Impl(const Model& given, std::span<const Channel> channels, double rate,
                          const Options& given_options)
    : model(without_periodic(given, left_out)),
      free(model),
      options(given_options),
      plan(live_plan(model, free, channels, rate, options.chapter)),
      solve_every(static_cast<std::size_t>(std::max(1.0, solve_period * rate))),
      history(static_cast<std::size_t>(std::max(fewest_ticks, options.chapter * rate)), rate),
      intake(plan, channels, model.driver.has_value(), history),
      fit(model, free, plan),
      misfit(options.misfit && free.size() > 0 ? std::make_unique<LiveMisfit>(model, plan) : nullptr) {}

/// A tick more is there.
void LiveEstimator::Impl::work() {
  follow();
  if (++since_solved >= solve_every) {
    since_solved = 0;
    const bool moves = free.size() > 0;
    solve();
    if (++since_errors >= errors_every) {
      since_errors = 0;
      if (moves) fit.find_errors();
    }
    if (moves && static_cast<double>(intake.counts().samples) * plan.period >= settle_first) fit.relinearise();
  }
  if (history.chapter_full()) begin_chapter();
}

/// Each simulation goes on along the history.
void LiveEstimator::Impl::follow() {
  const std::size_t end = history.complete();
  fit.advance(history.chapters(), end, options.catch_up);
  for (int k = 0; misfit && k < options.catch_up && misfit->advance(history.chapters(), end); ++k) {
  }
  if (!fit.advance_second(history.chapters(), end, options.catch_up)) return;
  if (misfit) misfit->learn(fit.pass().values());
  solve();
  fit.find_errors();
}

void LiveEstimator::Impl::solve() {
  if (free.size() == 0) return;
  const bool solved = fit.solve(noise_floors());
  if (solved && misfit) misfit->set_noise(fit.colours(), intake.gauge_noise());
}

/// Weights by the noise floor alone: by what is left, a signal that the model still misses would count for nothing, and
/// the fit could rest in a valley where it never catches up with it.
std::vector<NoiseColour> LiveEstimator::Impl::noise_floors() const {
  std::vector<NoiseColour> all;
  for (std::size_t o = 0; o < plan.outputs.size(); ++o) {
    const auto& output = plan.outputs[o];
    const double readings = output.slow ? 1 : static_cast<double>(plan.block);
    const double resolution = output.lsb / std::sqrt(12.0 * readings);
    NoiseColour c = fit.pass().floor(o).colour();
    if (output.slow) c = {.sigma = intake.sigma_of_meter(output.signal), .rho = 0};
    if (output.declared > 0) c.sigma = output.declared / std::sqrt(readings) * std::sqrt((1 + c.rho) / (1 - c.rho));
    c.sigma = std::max({c.sigma, resolution, 1e-9});
    all.push_back(c);
  }
  return all;
}

void LiveEstimator::Impl::begin_chapter() {
  const std::size_t end = history.current().ticks.size();
  fit.advance(history.chapters(), end, std::numeric_limits<int>::max());
  while (misfit && misfit->advance(history.chapters(), end)) {
  }
  fit.absorb_chapter(history.chapters().front().ticks.empty());
  history.begin_chapter(fit.pass().machines());
  fit.forget_chapter();
  if (misfit) misfit->forget_chapter();
}

std::vector<LiveParameter> LiveEstimator::Impl::parameters() const {
  const LiveSolution& solution = fit.solution();
  const LiveKnowledge& knowledge = fit.knowledge();
  const Eigen::VectorXd at = fit.estimate();
  const std::vector<double> values = free.spread(std::vector<double>(at.data(), at.data() + free.size()));
  const Eigen::VectorXd after = free.size() > 0 ? fit.variance_after_more() : Eigen::VectorXd();
  const std::vector<std::string> names = model.names();
  std::vector<LiveParameter> all;
  for (std::size_t place = 0; place < names.size(); ++place) {
    const Parameter& p = model.at(place);
    LiveParameter live{.name = names[place], .unit = p.unit, .value = values[place], .fixed = true};
    if (const auto mover = free.mover(place)) {
      const auto m = static_cast<Eigen::Index>(*mover);
      const double range = knowledge.high()[m] - knowledge.low()[m];  // a follower has no bounds
      live.fixed = false;
      live.std_error = std::min(std::sqrt(solution.variance()[m]), range / std::sqrt(12.0));
      live.at_bound = rests_at(knowledge.low()[m], at[m]) || rests_at(knowledge.high()[m], at[m]);
      live.excited = !live.at_bound && after[m] < (1 - excited_at) * solution.covariance()(m, m);
    }
    all.push_back(std::move(live));
  }
  return all;
}

std::map<Signal, double> LiveEstimator::Impl::states() const {
  std::map<Signal, double> all;
  all[Signal::omega] = fit.pass().simulated(Signal::omega);
  all[Signal::i_a] = fit.pass().simulated(Signal::i_a);
  if (model.input == Signal::u_ref) all[Signal::e_a] = fit.pass().simulated(Signal::e_a);
  return all;
}

std::map<Signal, double> LiveEstimator::Impl::left() const {
  std::map<Signal, double> all;
  const std::vector<double> left = fit.left();
  for (std::size_t o = 0; o < plan.outputs.size(); ++o) {
    if (left[o] > 0) all[plan.outputs[o].signal] = left[o];
  }
  return all;
}

std::vector<LiveInnovation> LiveEstimator::Impl::innovations() const {
  std::vector<LiveInnovation> all;
  for (std::size_t o = 0; o < plan.outputs.size(); ++o) {
    const LiveInnovationSums& sums = fit.pass().innovation(o);
    if (sums.weight <= 0) continue;
    const double floor = fit.colours()[o].sigma;
    const double rms = std::sqrt(sums.square / sums.weight);
    all.push_back({.signal = plan.outputs[o].signal,
                   .value = sums.value,
                   .normalised = floor > 0 ? rms / floor : 0,
                   .sigma = floor});
  }
  return all;
}

LiveEstimator::LiveEstimator(const Model& model, std::span<const Channel> channels, double rate)
    : LiveEstimator(model, channels, rate, Options{}) {}

LiveEstimator::LiveEstimator(const Model& model, std::span<const Channel> channels, double rate, const Options& options)
    : impl_(std::make_unique<Impl>(model, channels, rate, options)) {}

LiveEstimator::~LiveEstimator() = default;

void LiveEstimator::start_run(double field_on) { impl_->intake.start_run(field_on); }

void LiveEstimator::take(Signal signal, double t, double value) { impl_->take(signal, t, value); }

std::vector<LiveChange> LiveEstimator::news() {
  return impl_->misfit ? impl_->misfit->news() : std::vector<LiveChange>();
}

LiveEstimates LiveEstimator::estimates() const {
  LiveEstimates e{.t = impl_->fit.pass().t(),
                  .samples = impl_->intake.counts().samples,
                  .skipped = impl_->intake.counts().skipped,
                  .gaps = impl_->intake.counts().gaps,
                  .parameters = impl_->parameters(),
                  .left_out = impl_->left_out,
                  .states = impl_->states(),
                  .innovation = impl_->innovations(),
                  .left = impl_->left(),
                  .misfit = {}};
  e.fits = std::ranges::all_of(e.left, [](const auto& entry) { return entry.second < misfits_at; });
  if (impl_->misfit) e.misfit = impl_->misfit->report();
  return e;
}

}  // namespace emtb
