#pragma once

#include <functional>
#include <string>

namespace emtb {

/// Which of several equal processes this one is. It says where this one begins, not what it does: whoever is done helps
/// the others.
struct Rank {
  std::size_t number = 0, of = 1;  ///< 0 ... of - 1
  std::size_t on_machine = 1;      ///< ranks that share this machine, this one included
};

/// From `--shard K/N` (K from 1 to N), or else from what Open MPI (OMPI_COMM_WORLD_RANK), Slurm (SLURM_PROCID, or an
/// array's SLURM_ARRAY_TASK_ID) or another starter (PMI_RANK) tell in the environment.
/// @param environment std::getenv, or a test's @throws Error where `shard` is not of that form
Rank find_rank(const std::string& shard, const std::function<const char*(const char*)>& environment);

}  // namespace emtb
