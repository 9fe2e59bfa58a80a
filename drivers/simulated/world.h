#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "drivers/simulated/plant.h"
#include "hal/clock.h"
#include "hal/signal.h"

namespace emtb::simulated {

/// Somebody who looks at the plant at moments of their own: an averaging meter at the ends of its windows.
class Observer {
 public:
  virtual ~Observer() = default;

  /// The first time that the plant is looked at after World::restart(). @param t [s] on the clock
  virtual void begin(double t, const Plant& plant) noexcept = 0;
  virtual double due() const noexcept = 0;  ///< [s] on the clock, of the next look; infinity: never
  virtual void look(const Plant& plant) noexcept = 0;
};

/// The plant and its time, shared by the simulated devices of one bench.
///
/// The plant lives on the loop's clock: whoever reads or writes brings it up to now first, under the reference that
/// held until then. Thread-safe: a short spin, since neither the loop nor make_safe() may sleep.
class World {
 public:
  World(PlantParameters parameters, std::shared_ptr<const Clock> clock, std::uint64_t seed);

  /// Begins a recording: the plant's time falls on whole microseconds from the next look on, so that two recordings of
  /// the same profile take the same steps, whatever time it was.
  void restart() noexcept;

  /// Brings the plant up to now and hands it over: `act(t, plant, reference)`.
  template <class Act>
  void look(Act act) noexcept {
    const Lock lock(busy_);
    const double t = advance();
    act(t, plant_, reference_.load());
  }

  /// The same for a person at the bench, who turns the brake or opens the armature: `act(plant)`.
  template <class Act>
  void operate(Act act) {
    const Lock lock(busy_);
    advance();
    act(plant_);
  }

  /// A person holds the machine where this signal has this value, as for a calibration: its sensors see that, and the
  /// plant goes on without them.
  void hold(Signal signal, double value) noexcept {
    const Lock lock(busy_);
    held_[index(signal)] = value;
  }
  std::optional<double> held(Signal signal) const noexcept { return held_[index(signal)]; }  ///< within look()

  /// [V] from now on.
  void set_reference(double volts) noexcept;

  /// The same, at once and from any thread: where the plant is being looked at, without waiting for that.
  void force_reference(double volts) noexcept;

  double reference() const noexcept { return reference_.load(); }
  std::uint64_t seed() const noexcept { return seed_; }

  void attach(Observer* observer);
  void detach(Observer* observer);

 private:
  class Lock {
   public:
    explicit Lock(std::atomic_flag& flag) noexcept : flag_(flag) {
      while (flag_.test_and_set(std::memory_order_acquire)) {
      }
    }
    Lock(const Lock&) = delete;
    Lock& operator=(const Lock&) = delete;
    ~Lock() { flag_.clear(std::memory_order_release); }

   private:
    std::atomic_flag& flag_;
  };

  double advance() noexcept;
  void advance_to(double t) noexcept;

  Plant plant_;
  std::shared_ptr<const Clock> clock_;
  std::uint64_t seed_;
  std::atomic<double> reference_ = 0;
  std::atomic_flag busy_;
  std::vector<Observer*> observers_;
  std::array<std::optional<double>, signal_count> held_{};
  bool restarted_ = true;
  std::optional<double> origin_;  ///< [s] clock time of step 0
  std::int64_t steps_ = 0;        ///< [us] done since
};

}  // namespace emtb::simulated
