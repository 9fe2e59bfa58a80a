#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <string>

namespace emtb {

/// A name for a plant in a process of its own, and its memory: gone with the test.
class PlantName {
 public:
  PlantName() : name_("emtb-test-" + std::to_string(getpid()) + "-" + std::to_string(++made())) {}
  ~PlantName() { shm_unlink(("/" + name_).c_str()); }
  PlantName(const PlantName&) = delete;
  PlantName& operator=(const PlantName&) = delete;

  const std::string& text() const { return name_; }

  /// A fast small motor on a card with e_a, i_a, omega.
  std::string bench() const {
    return "name: plant\n"
           "rate: 1000\n"
           "realtime: prefer\n"
           "reference: {device: daq, min: 0, max: 6, safe: 0}\n"
           "limits: {omega: 620, i_a: 19, time: 1000}\n"
           "devices:\n"
           "  daq:\n"
           "    driver: simulated_daq\n"
           "    channels:\n"
           "      e_a: {range: [-30, 30], noise: 0.02}\n"
           "      i_a: {range: [-20, 20], noise: 0.01}\n"
           "      omega: {range: [-625, 625], noise: 0.3}\n"
           "simulation:\n"
           "  process: " +
           name_ +
           "\n"
           "  driver: {gain: 4, rise: 2000, fall: 2000, min: -24, max: 24}\n"
           "  motor: {R_a: 1.2, K_b: 0.042, K_m: 0.042, B: 1.0e-5, J: 6.0e-5}\n";
  }

 private:
  static int& made() {
    static int count = 0;
    return count;
  }
  std::string name_;
};

}  // namespace emtb
