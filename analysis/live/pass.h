#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "analysis/live/sums.h"
#include "hal/input_device.h"
#include "model/simulation.h"
#include "model/step.h"

namespace emtb {

/// What the fast instruments read at one tick; NaN: nothing.
struct LiveTick {
  static constexpr double none = std::numeric_limits<double>::quiet_NaN();
  enum class Kind : std::uint8_t { next, run_start, gap };

  double t = 0;      ///< [s] from the start of the run
  double u_ref = 0;  ///< [V] from now on
  double e_a = none, i_a = none, omega = none, torque = none, temperature = none;
  double drive = none;  ///< [V] across the motor, of e_a
  double load = 0;      ///< [N m] of the torque, where that is more than noise
  double field_on = 0;  ///< [s] of a run's start: since the field was switched on
  Kind kind = Kind::next;

  double* place(Signal signal);
  double at(Signal signal) const { return *const_cast<LiveTick*>(this)->place(signal); }
};

/// A slow meter's reading: the mean over a window.
struct SlowReading {
  std::size_t after = 0;      ///< the tick at which it was there
  std::size_t output = 0;     ///< place in LivePlan::outputs
  double begin = 0, end = 0;  ///< [s]
  double value = 0;
};

/// A part of the history that is forgotten as a whole.
struct LiveChapter {
  std::vector<LiveTick> ticks;
  std::vector<SlowReading> readings;
  std::vector<Machine<WideSensitive>> machines;  ///< as they were when it began; none: it begins with a run
};

/// A block of a fast signal or a reading of a slow one: how far it is from the simulation, and what would move it.
struct LiveRow {
  std::size_t output = 0;    ///< place in LivePlan::outputs
  const Eigen::VectorXd& s;  ///< derivatives by the unknowns
  double r = 0;              ///< SI, measured less simulated
  bool follows = false;      ///< the one before it came without a hole between
  const Eigen::VectorXd& s_before;
  double r_before = 0;
  double omega = 0, i_a = 0;  ///< SI, as simulated
};

/// Takes the rows of a pass, in the place of its own sums.
class LiveRows {
 public:
  virtual ~LiveRows() = default;
  virtual void take(const LiveRow& row) = 0;
};

/// What is compared with what, and which parameters move.
struct LivePlan {
  struct Output {
    Signal signal{};
    bool slow = false;
    double lsb = 0;
    double declared = 0;     ///< [SI] sigma; 0: not declared
    std::size_t offset = 0;  ///< of a slow output: its place among the unknowns
  };

  ModelStructure structure;
  std::vector<std::vector<std::size_t>> moved;  ///< by each free parameter, places in the structure
  std::vector<Output> outputs;
  double period = 1e-3;        ///< [s] of the ticks
  double longest_step = 1e-2;  ///< [s] of the simulation
  std::size_t block = 10;      ///< ticks whose mean counts as one
  std::size_t second = 1000;   ///< ticks whose residuals are told apart from others as independent
  std::size_t seconds = 61;    ///< of them in a chapter
  double longest_gap = 0.01;   ///< [s] between two ticks; beyond it the states are found anew
  double settling = 1;         ///< [s] after which a wrong initial state is forgotten
  double longest_window = 1;   ///< [s] of a slow meter, and how late it may come

  std::vector<Signal> direct;  ///< what an unknown adds to the readings of a signal, and to nothing else

  /// Unknowns: the free parameters, what is direct, then what each slow meter's rounding does to a value that stands
  /// still.
  std::size_t unknowns() const { return moved.size() + direct.size() + offsets; }
  std::size_t offsets = 0;
};

/// The noise floor of a fast signal, as the mean of a block has it: from the residuals' differences over one and two
/// blocks, which no slow error of a model reaches: E(Δ₁²) = 2σ²(1 - ρ), E(Δ₂²) = 2σ²(1 - ρ²).
class DifferenceFloor {
 public:
  void add(double r);
  void interrupt() { seen_ = 0; }
  Colour colour() const;  ///< rho: from block to block

 private:
  double first_ = 0, second_ = 0, firsts_ = 0, seconds_ = 0;
  double before_ = 0, before_that_ = 0;
  int seen_ = 0;
};

/// One simulation of the history with one set of parameters, from its beginning on, and the sums that it leaves.
class LivePass {
 public:
  struct Watch {  ///< of one output: the last second
    double value = 0, square = 0, weight = 0;
  };

  /// @param rows takes the rows; null: they go into sums()
  explicit LivePass(const LivePlan& plan, LiveRows* rows = nullptr);

  /// From the beginning of the history. @param values all parameters of the structure
  void begin(std::span<const double> values);

  /// Goes on with other parameters, from the present state.
  void follow(std::span<const double> values);

  /// Takes the next tick of the history. @return false where there is none
  /// @param end number of ticks of the last chapter that are complete
  bool advance(const std::vector<LiveChapter>& history, std::size_t end);

  /// The first chapter was forgotten, the second took its place.
  void forget_chapter();

  bool at_same_place(const LivePass& other) const { return chapter_ == other.chapter_ && tick_ == other.tick_; }
  const std::vector<double>& values() const { return values_; }
  /// By second, then by output.
  const std::vector<std::vector<LagSums>>& sums(std::size_t chapter) const { return sums_[chapter]; }
  const Eigen::MatrixXd& recent(std::size_t output) const { return recent_[output]; }
  const Watch& watch(std::size_t output) const { return watch_[output]; }
  const DifferenceFloor& floor(std::size_t output) const { return floor_[output]; }
  const std::vector<Machine<WideSensitive>>& machines() const { return machines_; }
  double t() const { return before_.t; }

  /// The difference to the parameters of values() that has been solved for: what innovations are to count from.
  void expect(const Eigen::VectorXd& step) { step_ = step; }

  /// A signal as simulated, at the parameters that are expected.
  double simulated(Signal signal) const;

 private:
  struct Block {
    double residual = 0;
    std::vector<WideSensitive> sum;
    std::size_t readings = 0;
  };
  struct Row {
    Eigen::VectorXd s;
    double r = 0;
    bool there = false;
  };

  void start_run(std::span<const LiveTick> ahead);
  void bridge_gap(std::span<const LiveTick> ahead);
  void step_to(const LiveTick& now);
  void watch_tick(const LiveTick& now);
  void close_blocks();
  void close_slow(const SlowReading& reading);
  void take_row(std::size_t output, double residual, double seconds);
  void add_direct(std::size_t output);
  void interrupt();
  void renew_machines();
  std::size_t integral_at(double t) const;

  const LivePlan& plan_;
  LiveRows* rows_;
  std::vector<double> values_;
  std::vector<std::vector<WideSensitive>> p_;  ///< for each machine: derivatives of its own
  std::vector<Machine<WideSensitive>> machines_;
  std::vector<std::vector<std::vector<LagSums>>> sums_;  ///< for each chapter, second and output
  std::vector<Row> row_before_;                          ///< of each output
  std::vector<double> predicted_before_, read_before_;   ///< by slow outputs
  std::vector<Eigen::MatrixXd> recent_;
  std::vector<Watch> watch_;
  std::vector<DifferenceFloor> floor_;
  std::vector<Block> blocks_;
  std::size_t in_block_ = 0;
  Eigen::VectorXd row_, step_;

  std::size_t chapter_ = 0, tick_ = 0, reading_ = 0;
  bool begun_ = false;
  LiveTick before_;
  double e_a_ = 0;              ///< [V] across the motor, the last that was known
  std::size_t unmeasured_ = 0;  ///< ticks since
  double valid_from_ = 0;       ///< [s] from then on the simulated states are right

  // The integral of each slow output over time, for the means of windows: a ring.
  struct Integral {
    double t = 0;
    std::vector<double> value;  ///< for each slow output: integral and value, then those of its derivatives
  };
  std::vector<Integral> integrals_;
  std::size_t newest_ = 0, stored_ = 0;
};

}  // namespace emtb
