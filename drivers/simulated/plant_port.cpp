#include "drivers/simulated/plant_port.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <system_error>
#include <utility>

#include "hal/error.h"

namespace emtb::simulated {
namespace {

constexpr double longest_silence = 1;  // [s] between two steps of a plant that lives; machines stall for half of it

std::string reason() { return std::generic_category().message(errno); }
std::string shown(const std::string& name) { return "/dev/shm/" + name; }

PlantPort* map(int file) {
  void* memory = mmap(nullptr, sizeof(PlantPort), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  return memory == MAP_FAILED ? nullptr : static_cast<PlantPort*>(memory);
}

}  // namespace

// No fence, which ThreadSanitizer does not know: each store of a field keeps the odd stamp before it, each load the
// second look at the stamp behind it.
void PlantPort::Device::publish(const Reading& reading) noexcept {
  const std::uint64_t n = head.load(std::memory_order_relaxed);
  Slot& slot = ring[n % ring_size];
  slot.stamp.store(2 * n + 1, std::memory_order_relaxed);
  slot.signal.store(index(reading.signal), std::memory_order_release);
  slot.sequence.store(reading.sequence, std::memory_order_release);
  slot.time.store(reading.time, std::memory_order_release);
  slot.value.store(reading.value, std::memory_order_release);
  slot.stamp.store(2 * n + 2, std::memory_order_release);
  head.store(n + 1, std::memory_order_release);
}

std::optional<Reading> PlantPort::Device::reading(std::uint64_t n) const noexcept {
  const Slot& slot = ring[n % ring_size];
  if (slot.stamp.load(std::memory_order_acquire) != 2 * n + 2) return {};
  const Reading reading{.signal = static_cast<Signal>(slot.signal.load(std::memory_order_acquire)),
                        .time = slot.time.load(std::memory_order_acquire),
                        .value = slot.value.load(std::memory_order_acquire),
                        .sequence = slot.sequence.load(std::memory_order_acquire)};
  if (slot.stamp.load(std::memory_order_relaxed) != 2 * n + 2) return {};
  return reading;
}

const PlantPort::Device* PlantPort::device(const std::string& name) const noexcept {
  const auto last = devices.begin() + static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(device_count, most_devices));
  const auto found = std::find_if(devices.begin(), last, [&](const Device& d) { return name == d.name.data(); });
  return found != last ? &*found : nullptr;
}

bool PlantPort::alive(double now) const noexcept { return ended.load() == 0 && now - beat.load() < longest_silence; }

PlantMemory PlantMemory::create(const std::string& name, double safe) {
  const int file = shm_open(("/" + name).c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0660);
  if (file < 0) throw DeviceError(shown(name) + ": cannot be made: " + reason());
  const auto fail = [&](const std::string& what) {
    close(file);
    throw DeviceError(shown(name) + ": " + what);
  };
  if (flock(file, LOCK_EX | LOCK_NB) != 0)
    fail("another emtb-plant lives there. Stop it, or give another process name");
  // Taken over as it stands, never made anew: a daemon that has it mapped sees the next plant in the same place.
  if (posix_fallocate(file, 0, sizeof(PlantPort)) != 0)
    fail("there is no room for " + std::to_string(sizeof(PlantPort)) + " bytes");
  PlantPort* port = map(file);
  if (port == nullptr) fail("cannot be mapped: " + reason());
  port->ready = 0;
  port->reference = safe;
  port->ended = 0;
  return {file, port};
}

PlantMemory PlantMemory::open(const std::string& name) {
  const int file = shm_open(("/" + name).c_str(), O_RDWR | O_CLOEXEC, 0);
  struct stat about {};
  const bool whole = file >= 0 && fstat(file, &about) == 0 && about.st_size >= static_cast<off_t>(sizeof(PlantPort));
  PlantPort* port = whole ? map(file) : nullptr;
  const std::string why = file < 0 ? reason() : "it is no plant of this version";
  if (file >= 0) close(file);
  if (port == nullptr || port->ready.load() != PlantPort::format) {
    if (port != nullptr) munmap(port, sizeof(PlantPort));
    throw DeviceError(shown(name) + ": no plant answers there: " + why +
                      ". Start `emtb-plant --config BENCH.yaml` first");
  }
  return {-1, port};
}

PlantMemory::PlantMemory(PlantMemory&& other) noexcept
    : file_(std::exchange(other.file_, -1)), port_(std::exchange(other.port_, nullptr)) {}

PlantMemory::~PlantMemory() {
  if (port_ != nullptr) munmap(port_, sizeof(PlantPort));
  if (file_ >= 0) close(file_);
}

std::optional<std::string> plant_process_name(const YamlMap& simulation) {
  if (!simulation.has("process")) return {};
  const std::string name = simulation.text("process");
  const bool good = !name.empty() && name.size() < 64 && std::ranges::all_of(name, [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_';
  });
  if (!good) simulation.fail("process", "is `" + name + "`. Write a name of letters, digits, - and _, e.g. emtb-plant");
  if (simulation.text_or("pace", "1") != "1") {
    simulation.fail("pace", "is " + simulation.text("pace") +
                                ", but a plant in a process of its own lives in real time. Let it be 1");
  }
  return name;
}

}  // namespace emtb::simulated
