#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <thread>
#include <vector>

#include "daemon/estimator_feed.h"
#include "hal/input_device.h"
#include "model/model.h"
#include "session/session.h"

namespace emtb {

class LiveEstimator;

/// The live estimates of the daemon: a thread of its own, which follows the bench with a model
/// (analysis/live/estimator.h).
///
/// It has what the loop tells by a ring of its own: a disk that delays the recorder delays no estimate. Neither the
/// loop nor the recorder ever waits for it: where the thread cannot keep up, samples are lost to it, are counted, and
/// the estimator finds its states anew.
class Estimator {
 public:
  struct Settings {
    std::vector<Channel> channels;  ///< what the bench measures
    double loop_rate = 1000;        ///< [Hz]
    double rate = 10;               ///< [Hz] of new estimates
    double share = 1;               ///< of the loop's period that a step of a model that is sent may take
  };

  explicit Estimator(Settings settings);
  ~Estimator();
  Estimator(const Estimator&) = delete;
  Estimator& operator=(const Estimator&) = delete;

  /// For the loop: what it tells.
  EstimatorFeed& feed() { return feed_; }

  /// Follows the bench with this model from now on, in the place of any other. From any thread but the loop's.
  /// @throws ModelError where the bench does not measure what the model needs.
  void follow(const Model& model);

  /// The same with a model that somebody sent: if a step of it is found to cost less than the loop's period, as
  /// measured on the estimator's own thread. Never waits.
  /// @return asked until it gives estimates(), null before; it throws ModelError where the model is refused
  /// @throws ModelError where another such model is being measured
  std::function<nlohmann::json()> propose(Model model);

  /// What the session of a run should tell: changes of the motor that were noticed since the last call. Never waits:
  /// what cannot be had now comes with the next call.
  /// @param run whose session is on, counted as the feed does; what was to be told of one before it comes too late
  std::vector<Event> remarks(std::uint32_t run);

  /// The latest: model, t, samples, lost, parameters, states, innovation, misfit ... From any thread.
  /// @throws ModelError where no model is followed: why.
  nlohmann::json estimates() const;

  /// Why there is no model, for estimates() to say.
  void explain(std::string why);

 private:
  struct Remark {
    std::uint32_t run = 0;
    Event event;
  };

  struct Proposal;

  void work();
  void follow_on(bool& news, std::chrono::steady_clock::time_point& due);
  void consider();
  void publish();
  void remark();

  const Settings settings_;
  EstimatorFeed feed_;

  mutable std::mutex mutex_;  // between follow(), estimates() and the thread
  std::unique_ptr<LiveEstimator> next_;
  std::shared_ptr<Proposal> proposal_;
  std::string next_name_;
  std::unique_ptr<nlohmann::json> latest_;
  std::string why_not_ =
      "no model is followed. Name one in the bench file, estimates: {model: FILE}, or give one: "
      "emtb estimates --model FILE";

  std::mutex remarks_mutex_;
  std::vector<Remark> remarks_;

  // The thread's own
  std::unique_ptr<LiveEstimator> estimator_;
  std::string name_;
  static constexpr std::uint32_t run_none = 0xffffffff;
  std::uint32_t followed_run_ = run_none;
  std::atomic<bool> quit_{false};
  std::thread thread_;
};

/// Numbers for the wire: {model, t, samples, lost, skipped, gaps, parameters {name: {value, std_error, unit, excited,
/// fixed}}, states {name: {value, unit}}, innovation {signal: {value, normalised, sigma, unit}}, left_out, misfit
/// {watching, score, changes [{since, noticed, omega, i_a, text, suspects [{name, change, std_error, score, unit}]}],
/// points_to [{name, change, std_error, score, unit}], where [{against, from, to, normalised {signal: times}}]}}.
nlohmann::json to_json(const LiveEstimator& estimator, const std::string& model, std::uint64_t lost);

}  // namespace emtb
