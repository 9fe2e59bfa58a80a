#include "hal/standard_streams.h"

#include <fcntl.h>
#include <unistd.h>

namespace emtb {

void have_standard_streams() noexcept {
  for (int file = STDIN_FILENO; file <= STDERR_FILENO; ++file) {
    // The lowest number that is free is the one that is missing.
    if (fcntl(file, F_GETFD) < 0) open("/dev/null", file == STDIN_FILENO ? O_RDONLY : O_WRONLY);
  }
}

}  // namespace emtb
