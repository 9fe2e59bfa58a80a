#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "analysis/live/history.h"
#include "analysis/live/noise_floor.h"
#include "analysis/live/plan.h"
#include "analysis/live/simulated_motor.h"
#include "analysis/live/window_means.h"

namespace emtb {

/// A block of a fast signal or a reading of a slow one: how far it is from the simulation, and what would move it.
struct LiveRow {
  std::size_t output = 0;             ///< place in LivePlan::outputs
  std::size_t chapter = 0, tick = 0;  ///< of the history
  const Eigen::VectorXd& s;           ///< derivatives by the unknowns
  double r = 0;                       ///< SI, measured less simulated
  bool follows = false;               ///< the one before it came without a hole between
  const Eigen::VectorXd& s_before;
  double r_before = 0;
  double omega = 0, i_a = 0;  ///< SI, as simulated
};

/// Takes the rows of a pass.
class LiveRows {
 public:
  virtual ~LiveRows() = default;
  virtual void take(const LiveRow& row) = 0;
  /// The rows that follow are of another block.
  virtual void end_block() {}
};

/// The innovation of one output: what it reads less what is expected, over the last second.
struct LiveInnovationSums {
  double value = 0;  ///< SI, of the last row
  double square = 0, weight = 0;
};

/// One simulation of a history with one set of parameters, from its beginning on, compared with what was read: means of
/// blocks of the fast signals, and each reading of the slow meters.
class LivePass {
 public:
  /// @param plan, rows are kept
  LivePass(const LivePlan& plan, LiveRows& rows);

  /// From the beginning of the history. @param values all parameters of the structure
  void begin(std::span<const double> values);

  /// Goes on with other parameters, from the present state.
  void follow(std::span<const double> values) { motor_.follow(values); }

  /// Takes the next tick of the history. @return false where there is none
  /// @param end number of ticks of the last chapter that are complete
  bool advance(const std::vector<LiveChapter>& history, std::size_t end);

  /// The first chapter was forgotten, the second took its place. Begins anew where it had not got beyond what is gone.
  void forget_chapter();
  bool in_first_chapter() const { return chapter_ == 0; }

  bool at_same_place(const LivePass& other) const { return chapter_ == other.chapter_ && tick_ == other.tick_; }
  const std::vector<double>& values() const { return motor_.values(); }
  const LiveInnovationSums& innovation(std::size_t output) const { return innovation_[output]; }
  const DifferenceFloor& floor(std::size_t output) const { return floor_[output]; }
  const std::vector<Machine<WideSensitive>>& machines() const { return motor_.machines(); }
  double t() const { return motor_.t(); }

  /// The difference to the parameters of values() that has been solved for: what innovations are to count from.
  void expect(const Eigen::VectorXd& step) { step_ = step; }

  /// A signal as simulated, at the parameters that are expected.
  double simulated(Signal signal) const;

 private:
  struct Block {
    double residual = 0;
    std::vector<WideSensitive> sum;  ///< of what was simulated, by machine
    std::size_t readings = 0;

    void clear();
  };
  struct RowBefore {
    Eigen::VectorXd s;
    double r = 0;
    bool there = false;
  };
  struct MeterBefore {
    double predicted = 0, read = 0;  ///< SI
  };

  bool find_next(const std::vector<LiveChapter>& history, std::size_t end);
  void move_motor(const LiveChapter& chapter);
  void compare_fast(const LiveTick& now);
  void close_blocks();
  void close_block(std::size_t output);
  void compare_slow(const SlowReading& reading);
  void add_direct(std::size_t output);
  void give_row(std::size_t output, double residual, double seconds);
  void innovate(std::size_t output, double residual, double seconds);
  bool row_informs() const;
  void interrupt();

  const LivePlan& plan_;
  LiveRows& rows_;
  SimulatedMotor motor_;
  WindowMeans windows_;
  std::vector<Block> blocks_;              ///< of each output
  std::size_t in_block_ = 0;               ///< ticks
  std::vector<RowBefore> row_before_;      ///< of each output
  std::vector<MeterBefore> meter_before_;  ///< of each output
  std::vector<DifferenceFloor> floor_;
  std::vector<LiveInnovationSums> innovation_;
  Eigen::VectorXd row_, step_;
  std::size_t chapter_ = 0, tick_ = 0, reading_ = 0;  ///< that come next
  bool begun_ = false;
};

}  // namespace emtb
