#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "config/yaml.h"
#include "drivers/clock_report.h"
#include "hal/input_device.h"

namespace emtb::simulated {

/// What a plant in a process of its own and the daemon share: readings one way, the reference the other.
///
/// It lives in shared memory, so that no call waits for the other side and either may die at any instant. The plant
/// alone writes readings; each ring is read from wherever a reader likes to begin, and a reader that dies leaves no
/// trace. The reference is one number that stays as it was written last: as a real card holds its output when its
/// program is gone.
struct PlantPort {
  static constexpr std::uint64_t format = 0x656d7462'706c6e33;  // "emtb" "pln3": another layout gets another number
  static constexpr std::size_t most_devices = 4;
  static constexpr std::size_t most_name = 96;
  static constexpr std::size_t ring_size = 1 << 15;  // readings: 0.65 s of five channels at 10 kHz

  /// One reading; `stamp` is 2n+2 once reading n is whole, odd while it is being written.
  struct Slot {
    std::atomic<std::uint64_t> stamp;
    std::atomic<std::uint64_t> signal;
    std::atomic<std::uint64_t> sequence;
    std::atomic<double> time;  ///< [s] CLOCK_MONOTONIC, the same for all processes
    std::atomic<double> value;
  };

  struct ChannelText {
    std::uint64_t signal;
    double period, window, lsb, low, high;
    std::uint64_t endless;
    std::array<char, most_name> source;
  };

  /// One device of the bench file, described once and for all before `ready`.
  struct Device {
    std::array<char, most_name> name;
    std::uint64_t channel_count;
    std::array<ChannelText, signal_count> channels;
    std::uint64_t has_clock;          ///< 1: it scans by a clock of its own
    ClockReport clock;                ///< which runs like this against CLOCK_MONOTONIC
    std::atomic<std::uint64_t> head;  ///< readings written so far
    std::array<Slot, ring_size> ring;

    /// Of the plant.
    void publish(const Reading& reading) noexcept;
    /// Reading n, or nothing where it is not written yet or already gone.
    std::optional<Reading> reading(std::uint64_t n) const noexcept;
  };

  std::atomic<std::uint64_t> ready;  ///< `format` once everything is described
  std::atomic<std::uint64_t> ended;  ///< 1: the plant was asked to end
  std::atomic<double> beat;          ///< [s] CLOCK_MONOTONIC of the plant's last step
  std::atomic<double> reference;     ///< [V] held until somebody writes another
  std::uint64_t device_count;
  std::array<Device, most_devices> devices;

  /// The device of that name, or null.
  const Device* device(const std::string& name) const noexcept;

  /// The plant answers. @param now [s] CLOCK_MONOTONIC
  bool alive(double now) const noexcept;
};

static_assert(std::atomic<double>::is_always_lock_free && std::atomic<std::uint64_t>::is_always_lock_free,
              "a lock cannot be shared with a process that may die");

/// The shared memory itself, mapped as long as this lives.
class PlantMemory {
 public:
  /// The plant's side: makes `/dev/shm/NAME`, or takes it over from a plant that is gone. The reference begins at
  /// `safe` [V], as that of a card that was switched on.
  /// @throws DeviceError where another plant lives there, or there is no room.
  static PlantMemory create(const std::string& name, double safe);

  /// The daemon's side. @throws DeviceError where there is no plant.
  static PlantMemory open(const std::string& name);

  PlantMemory(PlantMemory&& other) noexcept;
  PlantMemory& operator=(PlantMemory&&) = delete;
  ~PlantMemory();

  PlantPort& operator*() const noexcept { return *port_; }
  PlantPort* operator->() const noexcept { return port_; }

 private:
  PlantMemory(int file, PlantPort* port) : file_(file), port_(port) {}
  int file_ = -1;  ///< open and locked as long as the plant lives
  PlantPort* port_ = nullptr;
};

/// `simulation.process`, where the bench file asks for a plant in a process of its own.
/// @throws ConfigError where it is no name, or where another pace than 1 is asked for, too.
std::optional<std::string> plant_process_name(const YamlMap& simulation);

}  // namespace emtb::simulated
