#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <limits>
#include <vector>

#include "config/bench.h"
#include "daemon/estimator_feed.h"
#include "daemon/lateness.h"
#include "daemon/ring.h"
#include "daemon/safety.h"
#include "daemon/tacho_watch.h"
#include "daemon/trace.h"
#include "experiment/conditions.h"
#include "hal/bench.h"

namespace emtb {

/// A run, prepared outside of the loop. Whoever posts it keeps it until its end record came out of the ring.
struct Order {
  std::uint64_t id = 0;  ///< > 0, never used twice
  Profile profile;
  std::vector<Pause> pauses{};
  std::uint64_t stops = 0;  ///< Mailbox::stops when it was asked for: it never begins, or ends, once there are more
};

/// What other threads ask of the loop. Each field is one wish; the loop looks once a tick.
struct Mailbox {
  std::atomic<const Order*> run{nullptr};
  std::atomic<std::uint64_t> stops{0};        ///< counts stops, of all that was asked before; answered in Live::stops
  std::atomic<std::uint64_t> lost{0};         ///< id of the run whose client is gone
  std::atomic<std::uint64_t> confirmed{0};    ///< confirmation() of the pause that may end
  std::atomic<std::uint64_t> resets{0};       ///< counts wishes to arm; answered in Live::resets
  std::atomic<std::uint64_t> reset_stops{0};  ///< stops when the last of them was asked for
  std::atomic<bool> terminate{false};         ///< the process ends; never taken back
  std::atomic<std::uint64_t> guardians_lost{0};  ///< counts
  std::atomic<bool> unguarded{false};            ///< there is no new one
  std::atomic<bool> recorder_failed{false};
  std::atomic<bool> disk_low{false};  ///< the recorder still writes, but not for long

  /// Asks to arm. @return the number of this wish
  std::uint64_t reset() noexcept {
    reset_stops = stops.load();
    return ++resets;
  }
};

/// Of one pause of one run: a late one cannot end the next.
constexpr std::uint64_t confirmation(std::uint64_t run, std::size_t pause) noexcept { return run << 16 | (pause + 1); }

/// What the loop shows to other threads, each value by itself: good for eyes, not for computing.
struct Live {
  static constexpr double never = -std::numeric_limits<double>::infinity();

  std::atomic<LoopState> state{LoopState::latched};
  std::atomic<Fault> fault{Fault::none};
  std::atomic<int> fault_signal{-1};  ///< index of the signal that showed it, or -1
  std::atomic<double> fault_value{0};
  std::atomic<bool> output_broken{false};  ///< the reference output refused to go safe
  std::atomic<double> now{0};              ///< [s] on the loop's clock
  std::atomic<double> run_time{0};         ///< [s] since the run began, or its length when it ended
  std::atomic<double> profile_time{0};     ///< [s] how far the profile is: it waits with its operator
  std::atomic<double> u_ref{0};            ///< [V] as set
  std::atomic<int> pause{-1};              ///< the pause of the run that waits for a person, or -1
  std::atomic<std::uint64_t> ticks{0};
  std::atomic<std::uint64_t> missed{0};  ///< deadlines, since the start of the daemon
  std::atomic<std::uint64_t> resets{0};  ///< the last wish to arm that is decided
  std::atomic<std::uint64_t> stops{0};   ///< the last stop that is obeyed: the reference is safe, unless output_broken
  std::atomic<std::uint64_t> stopped_run{0};  ///< the run that it ended, or 0
  std::array<std::atomic<double>, signal_count> value{};
  std::array<std::atomic<double>, signal_count> time{};  ///< [s] on the loop's clock; `never`: no reading yet
  Lateness lateness;                                     ///< of waking, after the deadline
  Lateness work;                                         ///< of a tick, from waking to its end

  Live() {
    for (auto& t : time) t = never;
  }
};

/// The control loop's body. One thread calls it; tick() allocates nothing, locks nothing, logs nothing and throws
/// nothing.
///
/// Each tick reads every device, judges what it read, and sets the reference; whatever is wrong makes it safe in that
/// tick and latches. Readings and events go through the ring to the recorder, and readings through one to the
/// estimator.
class Loop {
 public:
  struct Settings {
    BenchConfig::SafetyLimits limits{};
    Limits reference{};                 ///< [V]
    double rate = 0;                    ///< [V/s]
    std::optional<double> field_min{};  ///< [A] of i_f
    std::optional<BenchConfig::Tacho> tacho{};
    double R_a = 0;           ///< [ohm] for tacho
    double period = 1e-3;     ///< [s]
    bool real_time = true;    ///< false: simulated time; waits for the recorder instead of faulting
    double late_limit = 0.5;  ///< [s] of missed deadlines within about a second: overrun
  };

  /// @param feed of the live estimator; null: there is none @param trace for those who watch; null: nobody does
  /// @throws ConfigError where two channels measure one signal, or a check needs one that none measures.
  Loop(Bench& bench, const Settings& settings, Mailbox& mailbox, Live& live, Ring& ring, EstimatorFeed* feed = nullptr,
       Trace* trace = nullptr);

  /// Starts the devices. Not real-time. A device that refuses is a fault, not an exception.
  void start() noexcept;

  /// Whether somebody wants a run or a reset: call prepare() then, between two ticks.
  bool wanted() const noexcept;

  /// Begins what is wanted; restarts devices, so not real-time. The reference is safe meanwhile.
  void prepare() noexcept;

  /// @param now [s] on the bench's clock; @param missed deadlines before this one
  void tick(double now, std::uint64_t missed = 0) noexcept;

  /// A run is on, or its last readings are still being collected.
  bool busy() const noexcept { return order_ != nullptr; }

 private:
  struct Watched {  // one channel
    Signal signal{};
    double patience = 0;  // [s] without a reading: stale
    double window = 0;    // [s]
    double last = 0;      // [s] time of the last reading, or when waiting for one began
    double stamp = 0;     // [s] of the last reading, as the device has it
    std::uint64_t next = 0;
    bool seen = false;  // since the device was started
  };
  struct Port {  // one device
    InputDevice* device = nullptr;
    std::optional<Signal> signal;  // its first, to name it by
    std::size_t first = 0;         // of its channels in watched_
    std::size_t count = 0;
  };

  bool start_devices() noexcept;
  void begin(const Order& order) noexcept;
  void read(double now) noexcept;
  void take(Port& port, const Reading& reading) noexcept;
  void watch(const Watched& watched, const Reading& reading) noexcept;
  void check(double now, std::uint64_t missed) noexcept;
  void obey_stop() noexcept;
  void arm_if_all_is_well() noexcept;
  void drive(double now) noexcept;
  double profile_time(double t) noexcept;
  void tell(int code, double t) noexcept;
  void trip(const Trip& trip) noexcept;
  Fault make_safe() noexcept;
  void end(Outcome outcome, Fault fault) noexcept;
  void enter(LoopState state) noexcept;
  void need(Signal signal, const char* key) const;
  void glimpse(Signal signal, double at, double value) noexcept;
  void push(const Record& record) noexcept;
  void push_surely(const Record& record) noexcept;
  void flush_pending() noexcept;
  void publish() noexcept;

  Bench& bench_;
  const Settings settings_;
  Mailbox& mailbox_;
  Live& live_;
  Ring& ring_;
  EstimatorFeed* feed_;
  Trace* trace_;
  Safety safety_;
  std::optional<TachoWatch> tacho_;

  std::vector<Port> ports_;
  std::vector<Watched> watched_;
  std::vector<Reading> buffer_;
  double linger_ = 0;  // [s] after a run for the last readings to arrive

  LoopState state_ = LoopState::latched;
  double now_ = 0;
  double dt_ = 0;  // [s] since the tick before
  double u_ = 0;   // [V] as set
  bool output_broken_ = false;
  double late_ = 0;                    // [s] missed lately
  std::optional<double> field_since_;  // [s] when the field was seen to come on; not watched: when the bench was armed
  double safe_again_ = 0;              // [s] when make_safe() is repeated while latched
  std::uint64_t resets_ = 0;
  std::uint64_t reset_stops_ = 0;  // when the arming that is on was asked for
  std::uint64_t stops_ = 0;
  std::uint64_t guardians_lost_ = 0;
  std::uint64_t stopped_run_ = 0;

  const Order* order_ = nullptr;
  bool ended_ = false;
  double t0_ = 0;                     // [s] start of the run; NaN until its first tick
  std::size_t pause_ = 0;             // the next one
  bool waiting_ = false;              // in it
  double waits_since_ = 0;            // [s] of the run
  double paused_ = 0;                 // [s] by which the profile is behind the run
  Record end_;                        // sent once the last readings are in
  std::array<Record, 32> pending_{};  // what the full ring refused and must not be lost
  std::size_t pending_count_ = 0;
};

}  // namespace emtb
