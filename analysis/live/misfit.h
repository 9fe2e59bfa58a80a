#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "analysis/live/change.h"
#include "analysis/live/normal_equations.h"
#include "analysis/live/pass.h"
#include "analysis/live/sums.h"
#include "model/model.h"

namespace emtb {

/// Watches for the moment at which a motor stops being what it was, and says what changed.
///
/// A simulation of its own, beside the live estimator's, with parameters that stay: those that the run has taught so
/// far. With u the unknowns (the free parameters; a few effects that the model lacks, at their null), the rows r = sᵀu
/// + noise of the last minutes give u₀ and its covariance C; those of the last N half-seconds the normal equations H u
/// = g. Without a change
///
///     y = g - H u₀  ~  N(0, H + H C H),
///
/// and a change of one unknown alone, δ eⱼ, adds H eⱼ δ to its mean. The generalised likelihood ratio over j and N
/// (Willsky and Jones 1976; Basseville and Nikiforov 1993, chapter 2) is the square of a score with one degree of
/// freedom, in standard errors. What crosses five, and stays there, is told: the j that explains most, those that
/// cannot be told apart from it, and the size.
///
/// H counts for as much as the scatter of the half-seconds before allows: noise with a colour, and what the model never
/// explained, are no change. Once told, the size is followed for some seconds; then the motor counts as what it has
/// become.
///
/// Memory is fixed after construction, but for what linear algebra of a dozen unknowns takes twice a second. Not
/// thread-safe.
class LiveMisfit final : private LiveRows {
 public:
  /// @param model without effects that repeat with the angle. @param plan of the estimator
  LiveMisfit(const Model& model, const LivePlan& plan);

  /// Takes the next tick of the estimator's history, as LivePass::advance().
  bool advance(const std::vector<LiveChapter>& history, std::size_t end);
  void forget_chapter() { pass_.forget_chapter(); }

  /// The noise floor of each output, as the estimator has it. @param of_gauge [N m] noise of a reading of the torque
  void set_noise(const std::vector<Colour>& colours, double of_gauge) {
    heard_ = colours;
    // A motor averages it over its time constant, of two blocks.
    load_noise_ = gauge_ ? of_gauge / std::sqrt(2.0 * static_cast<double>(plan_.block)) : 0;
  }

  /// The estimator found better values, in the order of the model. Taken while the motor is not known yet.
  void learn(std::span<const double> values);

  LiveMisfitReport report() const;

  /// Changes that were noticed since the last call.
  std::vector<LiveChange> news();

 private:
  struct Direction {
    std::string name, unit;
    double low = 0, high = 0;  ///< SI bounds
    bool in_model = false;
    std::size_t effect = 0;         ///< that the model lacks, where it is not in the model
    bool may_change = true;         ///< from one second to the next
    std::optional<std::size_t> at;  ///< place among the model's parameters
    double fixed_to = 0;            ///< standard deviation where the model file fixes it
    std::optional<Prior> prior;
  };
  struct Setup;
  struct Slot {
    std::vector<LagSums> sums;  ///< of each output
    double begin = 0;           ///< [s]
    std::size_t run = 0;
    double weight = 0, omega = 0, i_a = 0;  ///< of the squares that are left
  };
  struct Equations {
    Eigen::MatrixXd h;
    Eigen::VectorXd g;
    Equations& operator+=(const Equations& b) {
      h += b.h;
      g += b.g;
      return *this;
    }
  };
  /// What is known from before the ring, and what each of its slots adds.
  struct Timeline {
    Equations known;
    std::vector<Equations> slots;

    Equations before(std::size_t last) const;  ///< all but the last so many
    Equations recent(std::size_t last) const;  ///< these
  };
  struct Suspicion {
    double score = 0;  ///< of the best, standard errors
    double drop = 0;   ///< of the squares, by the best
    std::vector<LiveSuspect> suspects;
    std::vector<std::size_t> directions;  ///< of the suspects
    std::size_t slots = 0;                ///< the last so many are the changed ones
  };
  /// RMS of residuals over a range that grows as it must.
  struct Grid {
    static constexpr std::size_t bins = 16;
    struct Cell {
      double squares = 0, weight = 0;
    };
    double reach = 0;  ///< SI: from -reach to reach
    std::array<std::vector<Cell>, bins> cells;
    void add(double x, std::size_t output, double normalised);
  };

  explicit LiveMisfit(Setup setup);
  static Setup set_up(const Model& model, const LivePlan& plan);

  void take(const LiveRow& row) override;
  double value_of_direction(std::size_t j) const;
  static bool from_its_start(const std::vector<LiveChapter>& history);
  void clear();
  void close_slot();
  bool runs_evenly(const Slot& slot) const;
  void retire_oldest();
  double belief(const Direction& d) const;
  double slack_of(std::size_t j) const;
  Timeline timeline() const;
  void evaluate();
  void follow_change();
  void settle_into_change();
  void look_for_effects(const Equations& all, const Eigen::MatrixXd& covariance);
  void move_point(Eigen::VectorXd d);
  Equations equations(const std::vector<LagSums>& sums) const;
  bool shows_load(const Eigen::VectorXd& at, const Eigen::MatrixXd& covariance) const;
  std::vector<Equations> by_output(std::size_t slots) const;
  static bool contradicts(const std::vector<Equations>& signals, Eigen::Index j, double change,
                          const Eigen::VectorXd& at);
  /// Have the last so many slots changed?
  Suspicion look(const Timeline& time, std::size_t slots) const;
  Eigen::VectorXd inflation() const;
  LiveChange change_of(const Suspicion& suspicion) const;

  const LivePlan plan_;
  const std::vector<Direction> directions_;
  const std::size_t slot_ticks_;
  const Eigen::VectorXd digits_;              ///< [SI] of each unknown that is a meter's rounding; 0: it is none
  const std::vector<Eigen::Index> of_model_;  ///< the unknowns of the model as it is, and of its meters

  std::optional<std::size_t> gauge_;  ///< the unknown that is a load which a gauge shows
  std::optional<std::size_t> drag_;   ///< the unknown that brakes the shaft, as an error of that load does
  double gauge_digit_ = 0;            ///< [N m]
  double load_noise_ = 0;             ///< [N m] of a measured load, as far as the motor follows it
  bool loaded_ = false;               ///< it has shown loads, whatever else is learnt anew
  Eigen::VectorXd scaled_, scaled_before_;
  std::size_t inertia_ = 0;                 ///< the unknown that is J
  std::size_t flux_ = 0;                    ///< the unknown that is K_b
  double reach_omega_ = 0, reach_i_a_ = 0;  ///< the most that was seen

  std::vector<double> point_;  ///< values of the structure about which all is linear
  LivePass pass_;
  std::vector<Colour> colour_, heard_;  ///< that is used, and the latest: a change spoils that

  // Knowledge about the unknowns, from point_.
  Eigen::MatrixXd base_prior_, base_;
  Eigen::VectorXd base_prior_g_, base_g_;
  std::vector<LagSums> old_;            ///< of slots that have left the ring
  Eigen::VectorXd scatter_, expected_;  ///< of their scores, by unknown
  std::vector<Slot> ring_;              ///< oldest first; the last one is open
  std::size_t filled_ = 0;
  std::size_t ticks_ = 0, slots_seen_ = 0;
  double t_before_ = 0;
  Eigen::VectorXd expects_;  ///< where the unknowns are, for what is left
  std::size_t run_ = 0;

  bool own_ = false;  ///< it no longer follows the estimator's values
  /// The motor is known: what it has done so far is followed once more, for what was linear about the values of the
  /// first seconds says wrong things with small errors of directions in which little is told.
  bool follow_anew_ = false;
  std::size_t taught_ = 0;  ///< half-seconds since the estimator's values were last far from these
  double score_ = 0;
  int standing_ = 0;               ///< looks that a suspicion has stood
  std::size_t changed_slots_ = 0;  ///< since the change that is followed; 0: none is
  std::vector<LiveChange> changes_, news_;
  std::vector<LiveSuspect> points_to_;
  Grid by_speed_, by_current_;
};

}  // namespace emtb
