#pragma once

#include <vector>

#include "server/work_queue.h"
#include "tools/page/work.h"

namespace emtb::page {

/// What the worker answers.
std::vector<WorkMethod> work_methods();

/// The worker's process: requests come and answers go over the descriptor that server/worker_process.h gives it, until
/// that is closed. @return the exit code
int work_off(const Files& files);

}  // namespace emtb::page
