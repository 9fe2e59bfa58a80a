#include "daemon/estimator.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <exception>
#include <new>
#include <nlohmann/json.hpp>
#include <utility>

#include "analysis/live/estimator.h"
#include "daemon/finite_or_null.h"
#include "daemon/traffic.h"
#include "hal/error.h"

namespace emtb {
namespace {

using nlohmann::json;

constexpr double feed_seconds = 90;  ///< [s] of samples that may wait: simulated time brings a run all at once
constexpr auto pause = std::chrono::milliseconds(5);

std::size_t feed_size(const Estimator::Settings& settings) {
  const double per_second = readings_per_second(settings.channels, settings.loop_rate);
  return static_cast<std::size_t>(std::clamp(per_second * feed_seconds, 4096.0, 1e6));
}

/// [s] of this thread's processor time.
double worked() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Lets an estimator of the model follow a motor at rest for a while.
/// @throws ModelError where that takes longer than it lasts
void refuse_too_slow(const Model& model, const Estimator::Settings& settings) {
  constexpr double enough = 0.3;  // [s] of processor time
  const double period = 1 / settings.loop_rate;
  LiveEstimator trial(model, settings.channels, settings.loop_rate);
  trial.start_run();
  const double begin = worked();
  int ticks = 0;
  for (; worked() - begin < enough && ticks * period < enough; ++ticks) {
    const double t = ticks * period;
    for (const Channel& channel : settings.channels) {
      const int every = std::max(1, static_cast<int>(channel.period / period));
      if (ticks % every == 0) trial.take(channel.signal, t, 0);
    }
    trial.take(Signal::u_ref, t, 0);
  }
  const double step = (worked() - begin) / std::max(ticks, 1);
  if (step <= settings.share * period) return;
  throw ModelError(model.name + ": a step of it takes " + std::to_string(std::llround(step * 1e6)) +
                   " us here, but the loop makes one every " + std::to_string(std::llround(period * 1e6)) +
                   " us. Send a smaller model");
}

json to_json(const std::vector<LiveSuspect>& suspects) {
  json all = json::array();
  for (const LiveSuspect& s : suspects) {
    all.push_back({{"name", s.name},
                   {"change", finite_or_null(s.change)},
                   {"std_error", finite_or_null(s.std_error)},
                   {"score", finite_or_null(s.score)},
                   {"unit", s.unit}});
  }
  return all;
}

json to_json(const LiveMisfitReport& misfit) {
  json changes = json::array(), where = json::array();
  for (const LiveChange& c : misfit.changes) {
    changes.push_back({{"since", c.since},
                       {"noticed", c.noticed},
                       {"omega", finite_or_null(c.omega)},
                       {"i_a", finite_or_null(c.i_a)},
                       {"text", describe(c)},
                       {"suspects", to_json(c.suspects)}});
  }
  for (const LiveBin& bin : misfit.where) {
    json normalised = json::object();
    for (const auto& [signal, times] : bin.normalised) {
      normalised[std::string(info(signal).name)] = finite_or_null(times);
    }
    where.push_back(
        {{"against", info(bin.against).name}, {"from", bin.from}, {"to", bin.to}, {"normalised", normalised}});
  }
  return {{"watching", misfit.watching},
          {"score", finite_or_null(misfit.score)},
          {"changes", changes},
          {"points_to", to_json(misfit.points_to)},
          {"where", where}};
}

}  // namespace

json to_json(const LiveEstimator& estimator, const std::string& model, std::uint64_t lost) {
  const LiveEstimates e = estimator.estimates();
  json parameters = json::object(), states = json::object(), innovation = json::object(), left = json::object();
  for (const LiveParameter& p : e.parameters) {
    parameters[p.name] = {{"value", finite_or_null(p.value)},
                          {"std_error", p.fixed ? json(nullptr) : finite_or_null(p.std_error)},
                          {"unit", p.unit},
                          {"excited", p.excited},
                          {"at_bound", p.at_bound},
                          {"fixed", p.fixed}};
  }
  for (const auto& [signal, value] : e.states) {
    states[std::string(info(signal).name)] = {{"value", finite_or_null(value)}, {"unit", info(signal).unit}};
  }
  for (const LiveInnovation& i : e.innovation) {
    innovation[std::string(info(i.signal).name)] = {{"value", finite_or_null(i.value)},
                                                    {"normalised", finite_or_null(i.normalised)},
                                                    {"sigma", finite_or_null(i.sigma)},
                                                    {"unit", info(i.signal).unit}};
  }
  for (const auto& [signal, floors] : e.left) left[std::string(info(signal).name)] = finite_or_null(floors);
  return {{"model", model},
          {"t", e.t},
          {"samples", e.samples},
          {"lost", lost},
          {"skipped", e.skipped},
          {"gaps", e.gaps},
          {"parameters", parameters},
          {"states", states},
          {"innovation", innovation},
          {"fits", e.fits},
          {"left", left},
          {"left_out", e.left_out},
          {"misfit", to_json(e.misfit)}};
}

Estimator::Estimator(Settings settings) : settings_(std::move(settings)), feed_(feed_size(settings_)) {
  // Of the process's own priority. One that is killed is gone, and its ExecStopPost makes safe, only once each of its
  // threads has had the processor again: at SCHED_IDLE that took seconds on a busy machine (docs/reliability.md).
  thread_ = std::thread([this] { work(); });
}

Estimator::~Estimator() {
  quit_ = true;
  thread_.join();
}

void Estimator::follow(const Model& model) {
  auto next = std::make_unique<LiveEstimator>(model, settings_.channels, settings_.loop_rate);
  json empty = to_json(*next, model.name, 0);
  const std::lock_guard lock(mutex_);
  next_ = std::move(next);
  next_name_ = model.name;
  latest_ = std::make_unique<json>(std::move(empty));
}

struct Estimator::Proposal {
  Model model;
  json first{};              // what is answered
  std::exception_ptr why{};  // it is refused
  std::atomic<bool> done{false};
};

std::function<json()> Estimator::propose(Model model) {
  auto proposal = std::make_shared<Proposal>();
  proposal->model = std::move(model);
  const std::lock_guard lock(mutex_);
  if (proposal_) throw ModelError("another model is being measured. Ask again in a second");
  proposal_ = proposal;
  return [proposal]() -> json {
    if (!proposal->done.load(std::memory_order_acquire)) return nullptr;
    if (proposal->why) std::rethrow_exception(proposal->why);
    return proposal->first;
  };
}

/// On the estimator's thread: what a model costs is nobody else's time.
void Estimator::consider() {
  std::shared_ptr<Proposal> proposal;
  {
    const std::lock_guard lock(mutex_);
    proposal = proposal_;
  }
  if (!proposal) return;
  try {
    refuse_too_slow(proposal->model, settings_);
    follow(proposal->model);
    proposal->first = estimates();
  } catch (const Error&) {
    proposal->why = std::current_exception();
  } catch (const std::exception&) {  // no memory
    proposal->why = std::make_exception_ptr(ModelError(proposal->model.name + ": needs more memory than there is"));
  }
  proposal->done.store(true, std::memory_order_release);
  const std::lock_guard lock(mutex_);
  proposal_.reset();
}

void Estimator::explain(std::string why) {
  const std::lock_guard lock(mutex_);
  why_not_ = std::move(why);
}

std::vector<Event> Estimator::remarks(std::uint32_t run) {
  std::vector<Event> now;
  const std::unique_lock lock(remarks_mutex_, std::try_to_lock);
  if (!lock || remarks_.empty()) return now;
  for (Remark& r : remarks_) {
    if (r.run == run) now.push_back(std::move(r.event));
  }
  std::erase_if(remarks_, [run](const Remark& r) { return r.run <= run; });  // a slow recorder may be a run behind
  return now;
}

void Estimator::remark() {
  for (const LiveChange& change : estimator_->news()) {
    const std::lock_guard lock(remarks_mutex_);
    remarks_.push_back({followed_run_, {change.noticed, event_code::changed, describe(change)}});
  }
}

json Estimator::estimates() const {
  const std::lock_guard lock(mutex_);
  if (!latest_) throw ModelError("no live estimates: " + why_not_);
  json answer = *latest_;
  answer["lost"] = feed_.lost();
  return answer;
}

void Estimator::publish() {
  json now = to_json(*estimator_, name_, 0);
  const std::lock_guard lock(mutex_);
  if (!next_) latest_ = std::make_unique<json>(std::move(now));
}

void Estimator::work() {
  auto due = std::chrono::steady_clock::now();
  bool news = false;
  while (!quit_) {
    try {
      follow_on(news, due);
    } catch (const std::bad_alloc&) {  // the estimates end, nothing else
      estimator_.reset();
      const std::lock_guard lock(mutex_);
      latest_.reset();
      why_not_ = "no memory left";  // short enough to need none
    }
  }
}

/// What waits now.
void Estimator::follow_on(bool& news, std::chrono::steady_clock::time_point& due) {
  constexpr std::size_t at_once = 1000;
  const std::chrono::duration<double> period(1 / settings_.rate);
  consider();
  {
    std::unique_ptr<LiveEstimator> before;  // ends outside of the lock
    const std::lock_guard lock(mutex_);
    if (next_) {
      before = std::exchange(estimator_, std::move(next_));
      name_ = next_name_;
      followed_run_ = run_none;
    }
  }
  std::size_t count = 0;
  EstimatorFeed::Sample sample;
  while (count < at_once && feed_.pop(sample)) {
    ++count;
    if (!estimator_) continue;
    if (sample.run != followed_run_) {
      estimator_->start_run(sample.field_on);
      followed_run_ = sample.run;
    }
    estimator_->take(sample.signal, sample.t, sample.value);
  }
  if (estimator_ && count > 0) remark();
  news = news || count > 0;
  const auto now = std::chrono::steady_clock::now();
  if (estimator_ && news && now >= due) {
    publish();
    news = false;
    due = now + std::chrono::duration_cast<std::chrono::steady_clock::duration>(period);
  }
  if (count < at_once) std::this_thread::sleep_for(pause);
}

}  // namespace emtb
