#include "analysis/live/estimator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "analysis/live/misfit.h"
#include "analysis/live/pass.h"
#include "analysis/live/voltage.h"
#include "analysis/numerics/linear_algebra.h"
#include "hal/error.h"
#include "model/catalogue.h"

namespace emtb {
namespace {

constexpr double solve_period = 0.1;     ///< [s] between two solutions
constexpr std::size_t judge_every = 10;  ///< solutions between two looks at the standard errors
constexpr double relinearise_at = 0.2;   ///< standard errors from the point about which the equations are linear
constexpr double excited_at = 0.01;      ///< part of a variance that the last seconds, once more, would take away
constexpr double late_block = 0.02;      ///< [s] that a card which sends blocks may lag behind the reference
constexpr double gap_ticks = 5.5;        ///< without a tick: what happened meanwhile is not known
constexpr double settle_first = 0.5;     ///< [s] of data before the first step
constexpr std::size_t load_mean = 32;    ///< readings of the torque that tell a load from noise

/// The scatter of a slow meter, from the median change between its readings: most of them see a motor that is settled.
class SlowChanges {
 public:
  void add(double value) {
    if (count_ > 0) changes_[(count_ - 1) % changes_.size()] = std::abs(value - before_);
    before_ = value;
    ++count_;
  }
  double scatter() const {
    auto sorted = changes_;
    const std::size_t n = std::min(count_ > 0 ? count_ - 1 : 0, sorted.size());
    if (n == 0) return 0;
    std::nth_element(sorted.begin(), sorted.begin() + n / 2, sorted.begin() + n);
    return 1.4826 / std::sqrt(2.0) * sorted[n / 2];
  }

 private:
  std::array<double, 64> changes_{};
  std::size_t count_ = 0;
  double before_ = 0;
};

bool fast(const Channel& channel, double period) { return channel.window <= 0 && channel.period < 2 * period; }

const Channel* find(std::span<const Channel> channels, Signal signal) {
  const auto found = std::ranges::find(channels, signal, &Channel::signal);
  return found == channels.end() ? nullptr : &*found;
}

/// The model without what repeats with the angle: at which angle a run starts is not known.
Model without_periodic(Model model, std::vector<std::string>& left_out) {
  for (std::size_t e = 0; e < effect_count; ++e) {
    if (!effect_catalogue()[e].periodic || !model.includes(e)) continue;
    left_out.emplace_back(effect_catalogue()[e].id);
    model.exclude(e);
  }
  return model;
}

LivePlan plan_for(const Model& model, const FreeParameters& free, std::span<const Channel> channels, double rate,
                  double chapter) {
  LivePlan plan;
  plan.structure = model.structure();
  plan.moved = moved_by(free);
  plan.period = 1 / rate;
  const auto is_fast = [&](Signal signal) {
    const Channel* channel = find(channels, signal);
    return channel != nullptr && fast(*channel, plan.period);
  };
  if (model.input != Signal::u_ref && !is_fast(model.input)) {
    throw ModelError("model `" + model.name + "` is driven by " + std::string(info(model.input).name) +
                     ", which this bench does not measure at every tick. Give it `input: u_ref`");
  }
  plan.structure.measured_voltage = model.input != Signal::i_a && is_fast(Signal::e_a);
  plan.structure.measured_load = is_fast(Signal::torque);
  for (const Signal signal : {Signal::e_a, Signal::i_a, Signal::omega, Signal::torque}) {
    const Channel* channel = find(channels, signal);
    if (channel == nullptr || signal == model.input) continue;
    const auto declared = model.noise.find(signal);
    const bool slow = !fast(*channel, plan.period);
    plan.outputs.push_back({signal, slow, channel->lsb, declared == model.noise.end() ? 0 : declared->second});
    if (slow) plan.longest_window = std::max(plan.longest_window, 2 * std::max(channel->window, channel->period) + 1);
  }
  for (auto& output : plan.outputs) {
    if (output.slow) output.offset = plan.moved.size() + plan.offsets++;
  }
  if (!find(channels, Signal::omega) && !(find(channels, Signal::i_a) && model.input != Signal::i_a)) {
    throw ModelError("model `" + model.name +
                     "` has nothing to be compared with: the bench measures neither omega nor i_a");
  }
  const double time_constant = model.mechanical_time_constant();
  plan.longest_step = std::clamp(time_constant / 50, 2e-4, 1e-2);
  // Short against the shaft's time constant, so that a block's mean says what its readings do.
  plan.block = static_cast<std::size_t>(std::max(2.0, std::clamp(time_constant / 2, 0.0, 0.1) / plan.period));
  plan.second = static_cast<std::size_t>(std::max(1.0, std::max(1.0, 2 * time_constant) * rate));
  plan.seconds = static_cast<std::size_t>((chapter + 1) * rate) / plan.second + 1;
  plan.longest_gap = std::max(gap_ticks * plan.period, std::min(time_constant / 10, 0.1));
  plan.settling = std::clamp(7 * time_constant, 0.05, 20.0);
  return plan;
}

}  // namespace

struct LiveEstimator::Impl {
  Impl(const Model& given, std::span<const Channel> given_channels, double given_rate, const Options& given_options);

  void take(Signal signal, double t, double value);
  void close_tick(double t, double u_ref);
  void attach_pending(double newest);
  double load_of(double torque);
  void take_slow(std::size_t output, double t, double value);
  void work();
  void fold();
  void solve();
  void consider_relinearising();
  void judge_back();
  std::vector<Colour> colours() const;
  std::vector<LagSums> totals(const LivePass& pass, std::size_t chapters) const;
  void judge_errors();
  Eigen::VectorXd unknowns(const LivePass& pass) const;
  std::size_t complete() const;

  const Model whole;  ///< as given
  std::vector<std::string> left_out;
  const Model model;  ///< less what is left out
  const FreeParameters free;
  const std::vector<Channel> channels;
  const Options options;
  const LivePlan plan;
  const std::size_t capacity, lag, look_ahead, solve_every;

  std::vector<LiveChapter> history;
  std::unique_ptr<LivePass> front, back;
  std::unique_ptr<LiveMisfit> misfit;  ///< null: not wanted
  bool following = false;              ///< the back pass is on its way
  std::size_t hold = 0;                ///< tick of the last chapter whose successors must be there before it is taken
  bool new_run = true;
  double field_on = 0;  ///< [s] since the field was switched on, when the run began

  Eigen::VectorXd low, high;
  // Information, and its product with the values that it speaks for.
  Eigen::MatrixXd folded, known;  ///< of what is no longer in the history; the same and the priors'
  Eigen::VectorXd folded_at, known_at;
  double damping = 0;

  // Solution
  Eigen::VectorXd step, gradient;
  Eigen::MatrixXd information, covariance;  ///< as the weights claim
  Eigen::VectorXd variance;                 ///< as the residuals show
  double inflation = 1;                     ///< of the worst parameter's
  std::vector<Colour> colour;

  // Intake
  struct Pending {
    Signal signal;
    double t, value;
  };
  std::vector<Pending> pending;
  std::array<double, signal_count> last_slow{};
  std::array<SlowChanges, signal_count> slow_changes;
  double last_t = 0, last_u_ref = 0;
  std::array<double, load_mean> torques{};
  std::size_t torque_count = 0;
  double torque_sum = 0, torque_before = 0, torque_changes = 0, torque_lsb = 0;
  double loaded_until = -std::numeric_limits<double>::infinity();  ///< [s] by the noise of the gauge; never yet
  LiveVoltage voltage;
  SteadyMean steady_load;
  std::uint64_t samples = 0, skipped = 0, gaps = 0;
  std::size_t since_solved = 0, since_judged = 0;
};

LiveEstimator::Impl::Impl(const Model& given, std::span<const Channel> given_channels, double given_rate,
                          const Options& given_options)
    : whole(given),
      model(without_periodic(given, left_out)),
      free(model),
      channels(given_channels.begin(), given_channels.end()),
      options(given_options),
      plan(plan_for(model, free, channels, given_rate, given_options.chapter)),
      capacity(static_cast<std::size_t>(std::max(10.0, options.chapter * given_rate))),
      lag(static_cast<std::size_t>(std::ceil(late_block * given_rate))),
      look_ahead(static_cast<std::size_t>(0.035 * given_rate) + 4),
      solve_every(static_cast<std::size_t>(std::max(1.0, solve_period * given_rate))),
      history(2),
      front(std::make_unique<LivePass>(plan)),
      back(std::make_unique<LivePass>(plan)),
      misfit(options.misfit && free.size() > 0 ? std::make_unique<LiveMisfit>(model, plan) : nullptr),
      voltage(plan.structure, model.driver.has_value()) {
  for (LiveChapter& chapter : history) {
    chapter.ticks.reserve(capacity + look_ahead + lag + 2);
    chapter.readings.reserve(capacity / 2 + 16);
  }
  pending.reserve(1024);
  const auto n = static_cast<Eigen::Index>(plan.unknowns()), p_count = static_cast<Eigen::Index>(free.size());
  low.resize(n);
  high.resize(n);
  known = Eigen::MatrixXd::Zero(n, n);
  known_at = Eigen::VectorXd::Zero(n);
  for (const auto& output : plan.outputs) {
    if (!output.slow) continue;
    // A current that stands still is read with the same rounding all the time.
    const auto i = static_cast<Eigen::Index>(output.offset);
    const double digit = std::max(output.lsb, 1e-9);
    high[i] = digit;
    low[i] = -digit;
    known(i, i) = 12 / (digit * digit);
  }
  for (Eigen::Index i = 0; i < p_count; ++i) {
    const Parameter& p = model.at(free.places()[static_cast<std::size_t>(i)]);
    low[i] = p.min;
    high[i] = p.max;
    // Bounds alone say as much as an even distribution between them.
    const double range = p.max - p.min;
    known(i, i) = p.prior ? 1 / (p.prior->std * p.prior->std) : 12 / (range * range);
    known_at[i] = known(i, i) * (p.prior ? p.prior->value : p.value);
  }
  step = Eigen::VectorXd::Zero(n);
  information = known;
  folded = Eigen::MatrixXd::Zero(n, n);
  folded_at = Eigen::VectorXd::Zero(n);
  gradient = step;
  covariance = n > 0 ? inverse_of(known) : known;
  variance = covariance.diagonal();
  colour.assign(plan.outputs.size(), {});
  front->begin(free.spread(free.pick({})));
  if (const Channel* torque = find(channels, Signal::torque)) torque_lsb = torque->lsb;
}

/// The point about which the equations of a pass are linear; they are linear in offsets anyway.
Eigen::VectorXd LiveEstimator::Impl::unknowns(const LivePass& pass) const {
  const std::vector<double> values = free.pick(pass.values());
  Eigen::VectorXd at = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(plan.unknowns()));
  std::ranges::copy(values, at.data());
  return at;
}

void LiveEstimator::Impl::take(Signal signal, double t, double value) {
  if (!std::isfinite(t) || !std::isfinite(value)) {
    ++skipped;
    return;
  }
  if (signal == Signal::u_ref) return close_tick(t, value);
  const auto output = std::ranges::find(plan.outputs, signal, &LivePlan::Output::signal);
  if (output != plan.outputs.end() && output->slow) {
    return take_slow(static_cast<std::size_t>(output - plan.outputs.begin()), t, value);
  }
  if (LiveTick{}.place(signal) == nullptr) return;
  if (pending.size() == pending.capacity()) {
    ++skipped;
    return;
  }
  pending.push_back({signal, t, value});
}

void LiveEstimator::Impl::take_slow(std::size_t output, double t, double value) {
  const Channel& channel = *find(channels, plan.outputs[output].signal);
  slow_changes[index(channel.signal)].add(value);
  double& before = last_slow[index(channel.signal)];
  const double begin = channel.window > 0 ? t - channel.window : before;
  before = t;
  LiveChapter& current = history.back();
  if (std::isnan(begin) || t <= begin || current.readings.size() == current.readings.capacity()) return;
  if (t - begin > plan.longest_window) return;
  current.readings.push_back({current.ticks.size(), output, begin, t, value});
}

double LiveEstimator::Impl::load_of(double torque) {
  if (!std::isfinite(torque)) return 0;
  double& slot = torques[torque_count % load_mean];
  torque_sum += torque - slot;
  slot = torque;
  const double change = torque - torque_before;
  torque_before = torque;
  if (++torque_count < load_mean) return 0;
  torque_changes += (change * change - torque_changes) / static_cast<double>(std::min<std::size_t>(torque_count, 2000));
  if (torque_count % load_mean == 0) {  // no rounding piles up
    torque_sum = 0;
    for (const double x : torques) torque_sum += x;
  }
  const double mean = std::abs(torque_sum) / load_mean;
  const double limit = 6 * std::sqrt(0.5 * torque_changes / load_mean) + 2 * torque_lsb;
  if (mean > limit) loaded_until = last_t + 1;
  const double steady = steady_load.next(torque);
  return last_t < loaded_until ? steady : 0;
}

void LiveEstimator::Impl::close_tick(double t, double u_ref) {
  LiveChapter& current = history.back();
  LiveTick tick;
  tick.t = t;
  tick.u_ref = u_ref;
  if (new_run) {
    tick.kind = LiveTick::Kind::run_start;
    tick.field_on = field_on;
    last_slow.fill(LiveTick::none);
    hold = current.ticks.size();
    new_run = false;
    if (std::isfinite(loaded_until)) loaded_until = t + plan.settling;
  } else if (t <= last_t) {
    ++skipped;
    return;
  } else if (t - last_t > plan.longest_gap) {
    tick.kind = LiveTick::Kind::gap;
    hold = current.ticks.size();
    ++gaps;
  }
  const double before = last_t;
  last_t = t;
  ++samples;
  current.ticks.push_back(tick);
  attach_pending(t);
  LiveTick& newest = current.ticks.back();
  if (newest.kind == LiveTick::Kind::next) {
    newest.drive = voltage.next(t - before, u_ref, newest.e_a);
  } else {
    voltage.start(u_ref, newest.e_a);
    newest.drive = newest.e_a;
  }
  if (plan.structure.measured_load) {
    // The speed follows the reference, and a load the speed, long before noise lets it be seen.
    if (u_ref != last_u_ref) {
      steady_load.expect_change(static_cast<int>(plan.settling / plan.period));
      // What has loaded the shaft before does so as it starts, below the noise at first.
      if (std::isfinite(loaded_until)) loaded_until = std::max(loaded_until, t + plan.settling);
    }
    newest.load = load_of(newest.torque);
  }
  last_u_ref = u_ref;
  work();
}

void LiveEstimator::Impl::attach_pending(double newest) {
  auto& ticks = history.back().ticks;
  std::size_t kept = 0;
  for (const Pending& reading : pending) {
    if (reading.t > newest + 0.5 * plan.period) {
      if (reading.t < newest + 1) pending[kept++] = reading;
      continue;
    }
    std::size_t k = ticks.size() - 1;
    const std::size_t first = ticks.size() > lag ? ticks.size() - lag : 0;
    while (k > first && ticks[k].kind != LiveTick::Kind::run_start &&
           std::abs(ticks[k - 1].t - reading.t) < std::abs(ticks[k].t - reading.t)) {
      --k;
    }
    if (std::abs(ticks[k].t - reading.t) > gap_ticks * plan.period) {
      ++skipped;
      continue;
    }
    *ticks[k].place(reading.signal) = reading.value;
  }
  pending.resize(kept);
}

/// So many ticks of the last chapter will not change any more.
std::size_t LiveEstimator::Impl::complete() const {
  const std::size_t size = history.back().ticks.size();
  if (size - hold < look_ahead + lag) return hold;
  return size - lag;
}

void LiveEstimator::Impl::work() {
  const std::size_t end = complete();
  const auto catch_up = [&](auto& pass) {
    for (int k = 0; k < options.catch_up && pass.advance(history, end); ++k) {
    }
  };
  catch_up(*front);
  if (misfit) catch_up(*misfit);
  if (following) {
    catch_up(*back);
    if (back->at_same_place(*front)) judge_back();
  }
  if (++since_solved >= solve_every) {
    since_solved = 0;
    solve();
    if (++since_judged >= judge_every) {
      since_judged = 0;
      judge_errors();
    }
    consider_relinearising();
  }
  if (history.back().ticks.size() >= capacity && history.back().ticks.size() - hold >= look_ahead + lag) fold();
}

std::vector<LagSums> LiveEstimator::Impl::totals(const LivePass& pass, std::size_t chapters) const {
  std::vector<LagSums> sums(plan.outputs.size(), LagSums(static_cast<Eigen::Index>(plan.unknowns())));
  for (std::size_t chapter = 0; chapter < chapters; ++chapter) {
    for (const auto& second : pass.sums(chapter)) {
      for (std::size_t o = 0; o < sums.size(); ++o) {
        if (second[o].blocks() > 0) sums[o].add(second[o]);
      }
    }
  }
  return sums;
}

/// Weights by the noise floor alone: by what is left, a signal that the model still misses would count for nothing, and
/// the fit could rest in a valley where it never catches up with it.
std::vector<Colour> LiveEstimator::Impl::colours() const {
  std::vector<Colour> all;
  for (std::size_t o = 0; o < plan.outputs.size(); ++o) {
    const auto& output = plan.outputs[o];
    const double readings = output.slow ? 1 : static_cast<double>(plan.block);
    const double resolution = output.lsb / std::sqrt(12.0 * readings);
    Colour c = front->floor(o).colour();
    if (output.slow) c = {.sigma = slow_changes[index(output.signal)].scatter(), .rho = 0};
    if (output.declared > 0) c.sigma = output.declared / std::sqrt(readings) * std::sqrt((1 + c.rho) / (1 - c.rho));
    c.sigma = std::max({c.sigma, resolution, 1e-9});
    all.push_back(c);
  }
  return all;
}

void LiveEstimator::Impl::solve() {
  if (free.size() == 0) return;
  const Eigen::VectorXd at = unknowns(*front);
  const std::vector<LagSums> sums = totals(*front, 2);
  colour = colours();
  Eigen::MatrixXd h = known;
  Eigen::VectorXd g = known_at - known * at;
  for (std::size_t o = 0; o < plan.outputs.size(); ++o) sums[o].weigh_into(h, g, colour[o]);
  if (!h.allFinite() || !g.allFinite()) return;
  information = h;
  gradient = g;
  step = bounded_step(h, g, low - at, high - at);
  front->expect(step);
  if (misfit) misfit->hear(colour, std::sqrt(0.5 * torque_changes));
}

/// Standard errors that hold whatever the colour of the noise, and where one source of it is in several signals: by
/// leaving out one second after another (the cluster-robust CR3 of Bell and McCaffrey 2002).
void LiveEstimator::Impl::judge_errors() {
  if (free.size() == 0) return;
  const Eigen::Index n = information.rows();
  covariance = inverse_of(information);
  Eigen::MatrixXd meat = known;
  int seconds = 0;
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(n, n);
  for (const std::size_t chapter : {0U, 1U}) {
    for (const auto& second : front->sums(chapter)) {
      Eigen::MatrixXd h = Eigen::MatrixXd::Zero(n, n);
      Eigen::VectorXd g = Eigen::VectorXd::Zero(n);
      for (std::size_t o = 0; o < plan.outputs.size(); ++o) {
        if (second[o].blocks() > 0) second[o].weigh_into(h, g, colour[o]);
      }
      if (h.trace() <= 0) continue;
      ++seconds;
      const Eigen::VectorXd left = solve_normal(one - h * covariance, g - h * step);
      if (left.allFinite()) meat.noalias() += left * left.transpose();
    }
  }
  const Eigen::MatrixXd robust = covariance * meat * covariance;
  constexpr int few = 20;
  inflation = 1;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double white = covariance(i, i);
    // Few seconds tell little of their own scatter.
    const double least = (seconds < few ? 1 : 0.1) * white;
    variance[i] = std::max(robust(i, i), least);
    inflation = std::max(inflation, variance[i] / white);
  }
}

void LiveEstimator::Impl::consider_relinearising() {
  if (following || free.size() == 0 || static_cast<double>(samples) * plan.period < settle_first) return;
  const auto p = static_cast<Eigen::Index>(free.size());
  const Eigen::MatrixXd uncertain = inverse_of(information).topLeftCorner(p, p);
  const double distance = std::sqrt(std::max(0.0, step.head(p).dot(inverse_of(uncertain) * step.head(p))));
  if (distance < relinearise_at) return;
  const Eigen::VectorXd at = unknowns(*front);
  // No further than the linear equations can be trusted: a factor of three, a third of the bounds from zero.
  Eigen::VectorXd least = low - at, most = high - at;
  for (Eigen::Index i = 0; i < p; ++i) {
    const double reach = std::max(2.0 / 3 * std::abs(at[i]), low[i] > 0 ? 0.0 : (high[i] - low[i]) / 3);
    least[i] = std::max(least[i], -reach);
    most[i] = std::min(most[i], low[i] > 0 ? 3 * reach : reach);
  }
  Eigen::MatrixXd h = information;
  h.diagonal() *= 1 + damping;
  const Eigen::VectorXd to = at + bounded_step(h, gradient, least, most);
  if (!to.allFinite()) return;
  back->begin(free.spread(std::vector<double>(to.data(), to.data() + p)));
  following = true;
}

void LiveEstimator::Impl::judge_back() {
  following = false;
  Eigen::VectorXd offsets = step;
  offsets.head(static_cast<Eigen::Index>(free.size())).setZero();
  const auto cost = [&](const LivePass& pass) {
    double sum = 0;
    const std::vector<LagSums> sums = totals(pass, 2);
    for (std::size_t o = 0; o < plan.outputs.size(); ++o) sum += sums[o].cost(offsets, colour[o]);
    const Eigen::VectorXd at = unknowns(pass) + offsets;
    return sum + at.dot(known * at) - 2 * at.dot(known_at);
  };
  const double now = cost(*front), then = cost(*back);
  if (!(then < now + 1e-3)) {  // also where it is not finite
    damping = std::max(1e-2, 10 * damping);
    return;
  }
  damping = damping < 1e-3 ? 0 : damping / 10;
  std::swap(front, back);
  if (misfit) misfit->learn(front->values());
  step.setZero();
  solve();
  judge_errors();
}

void LiveEstimator::Impl::fold() {
  while (front->advance(history, history.back().ticks.size())) {
  }
  while (misfit && misfit->advance(history, history.back().ticks.size())) {
  }
  following = false;
  if (free.size() > 0 && !history.front().ticks.empty()) {
    const Eigen::VectorXd at = unknowns(*front);
    const std::vector<LagSums> sums = totals(*front, 1);
    Eigen::MatrixXd added = Eigen::MatrixXd::Zero(known.rows(), known.cols());
    Eigen::VectorXd pull = Eigen::VectorXd::Zero(known.rows());
    for (std::size_t o = 0; o < plan.outputs.size(); ++o) {
      sums[o].weigh_into(added, pull, colour[o]);
    }
    added /= inflation;
    pull /= inflation;
    if (added.allFinite() && pull.allFinite()) {
      // In the directions in which the old knowledge is one: as much as is new of each takes its place, half at most.
      const Eigen::VectorXd old_at = solve_normal(folded, folded_at);
      const Eigen::VectorXd size = known.diagonal().cwiseSqrt();
      const Eigen::MatrixXd scaled = size.cwiseInverse().asDiagonal() * known * size.cwiseInverse().asDiagonal();
      const Eigen::MatrixXd root = size.asDiagonal() * cholesky(scaled);
      Eigen::MatrixXd inverse(known.rows(), known.cols());  // of the root
      const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(known.rows(), known.cols());
      for (Eigen::Index j = 0; j < known.cols(); ++j) inverse.col(j) = solve_lower(root, one.col(j));
      const Eigensystem eigen = eigensystem(inverse * added * inverse.transpose());
      Eigen::VectorXd left(eigen.values.size());
      for (Eigen::Index i = 0; i < left.size(); ++i) {
        left[i] = std::sqrt(1 - 0.5 * std::clamp(2 * eigen.values[i], 0.0, 1.0));
      }
      const Eigen::MatrixXd keep = root * eigen.vectors * left.asDiagonal() * eigen.vectors.transpose() * inverse;
      const Eigen::MatrixXd old = keep * folded * keep.transpose();
      known += old + added - folded;
      known_at += old * old_at + added * at + pull - folded_at;
      folded_at += old * old_at + added * at + pull - folded_at;
      folded = old + added;
    }
  }
  std::swap(history.front(), history.back());
  LiveChapter& current = history.back();
  current.ticks.clear();
  current.readings.clear();
  current.machines.clear();
  current.machines.reserve(front->machines().size());
  for (const auto& machine : front->machines()) current.machines.push_back(machine);
  hold = 0;
  front->forget_chapter();
  if (misfit) misfit->forget_chapter();
}

LiveEstimator::LiveEstimator(const Model& model, std::span<const Channel> channels, double rate)
    : LiveEstimator(model, channels, rate, Options{}) {}

LiveEstimator::LiveEstimator(const Model& model, std::span<const Channel> channels, double rate, const Options& options)
    : impl_(std::make_unique<Impl>(model, channels, rate, options)) {}

LiveEstimator::~LiveEstimator() = default;

void LiveEstimator::start_run(double field_on) {
  impl_->new_run = true;
  impl_->field_on = field_on;
  impl_->pending.clear();
}

void LiveEstimator::take(Signal signal, double t, double value) { impl_->take(signal, t, value); }

std::vector<LiveChange> LiveEstimator::news() {
  return impl_->misfit ? impl_->misfit->news() : std::vector<LiveChange>();
}

LiveEstimates LiveEstimator::estimates() const {
  const Impl& i = *impl_;
  LiveEstimates e;
  e.t = i.front->t();
  e.samples = i.samples;
  e.skipped = i.skipped;
  e.gaps = i.gaps;
  e.left_out = i.left_out;
  const Eigen::VectorXd at = i.unknowns(*i.front) + i.step;
  const std::vector<double> values = i.free.spread(std::vector<double>(at.data(), at.data() + i.free.size()));
  // What the last seconds, once more, would add.
  Eigen::VectorXd after = i.covariance.diagonal();
  if (i.free.size() > 0) {
    Eigen::MatrixXd more = i.information;
    for (std::size_t o = 0; o < i.plan.outputs.size(); ++o) {
      const Colour& c = i.colour[o];
      more += (1 - c.rho) / ((1 + c.rho) * c.sigma * c.sigma) * i.front->recent(o);
    }
    after = inverse_of(more).diagonal();
  }
  const std::vector<std::string> names = i.model.names();
  for (std::size_t place = 0; place < names.size(); ++place) {
    const Parameter& p = i.model.at(place);
    LiveParameter live{.name = names[place], .unit = p.unit, .value = values[place], .fixed = true};
    if (const auto mover = i.free.mover(place)) {
      const auto m = static_cast<Eigen::Index>(*mover);
      live.fixed = false;
      live.std_error =
          std::min(std::sqrt(i.variance[m]), (i.high[m] - i.low[m]) / std::sqrt(12.0));  // a follower has no bounds
      live.excited = after[m] < (1 - excited_at) * i.covariance(m, m);
    }
    e.parameters.push_back(std::move(live));
  }
  e.states[Signal::omega] = i.front->simulated(Signal::omega);
  e.states[Signal::i_a] = i.front->simulated(Signal::i_a);
  if (i.model.input == Signal::u_ref) e.states[Signal::e_a] = i.front->simulated(Signal::e_a);
  for (std::size_t o = 0; o < i.plan.outputs.size(); ++o) {
    const auto& output = i.plan.outputs[o];
    const auto& watch = i.front->watch(o);
    if (watch.weight <= 0) continue;
    LiveInnovation innovation{.signal = output.signal, .value = watch.value};
    const double floor = innovation.sigma = i.colour[o].sigma;
    innovation.normalised = floor > 0 ? std::sqrt(watch.square / watch.weight) / floor : 0;
    e.innovation.push_back(innovation);
  }
  if (i.misfit) e.misfit = i.misfit->report();
  return e;
}

}  // namespace emtb
