#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/discover/discover.h"
#include "session/session.h"
#include "tests/blind/recording.h"

namespace emtb::blind {

/// Runs of which not all are of the same machine, or of which one was disturbed.
enum class MachineKind {
  healthy,    ///< all runs of one machine
  lacking,    ///< the same, with an effect that the model lacks
  changed,    ///< one run with a parameter of its own
  from_then,  ///< all runs from one on
  drift,      ///< a parameter that grows from run to run
  disturbed   ///< a torque for a while within one run
};
std::string_view name_of(MachineKind kind) noexcept;

struct MachineCase {
  std::string id;
  MachineKind kind{};
  Bench bench;  ///< of the runs that are as they were
  std::vector<Run> train, held_out;
  std::string run;              ///< of which something is said: the changed one, or the first of them
  std::size_t place = 0;        ///< of that run
  std::string parameter;        ///< `R_a`; of a law of the torque `K_b` stands for both constants
  double by = 0;                ///< to/from - 1, of a drift from first to last
  double from_s = 0, to_s = 0;  ///< of a disturbance
  double torque = 0;            ///< [N m] it accelerates
  double squares = 0;  ///< of a disturbance: by how much it moves what is read, in units of the true sigma and as many
                       ///< as are independent, the sum of squares of the signal that shows it best
  bool recurs = true;  ///< as many readings elsewhere were taken at like speed and reference
};

/// Case `number` of a kind, all from one seed.
MachineCase make_machine_case(MachineKind kind, std::size_t number, std::uint64_t seed);

/// What `discover` says of a case, and whether somebody who knows where to look would see it.
struct MachineAnswer {
  bool visible = false;    ///< to the oracle
  bool found = false;      ///< the run and the parameter, or the disturbance
  bool otherwise = false;  ///< something else was named, in `changed` or `disturbances`
  bool disturbance_named = false, change_named = false, law_offered = false;
  double seconds = 0;
  std::string said;
};
MachineAnswer ask(const MachineCase& c);

/// `17 of 20 (64 to 95 %)`: Wilson's interval at 95 %.
std::string counted_with_interval(std::size_t hits, std::size_t all);

}  // namespace emtb::blind
