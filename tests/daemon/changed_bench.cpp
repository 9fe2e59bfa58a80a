#include "tests/daemon/changed_bench.h"

#include "tests/estimate/live_bench.h"

namespace emtb {

ChangedBench rubbing_bench() {
  const live_bench::LiveBench bench = live_bench::slow_live_bench();
  return {.model = bench.model,
          .channels = bench.channels(),
          .rate = bench.setup.rate,
          .run = live_bench::changed_run(bench, live_bench::rubbing(0.02), 1),
          .changed_at = live_bench::changed_at};
}

}  // namespace emtb
