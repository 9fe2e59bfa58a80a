#include "config/shipped.h"

#include "hal/error.h"

namespace emtb {

std::filesystem::path shipped(const std::filesystem::path& file) {
  std::error_code ignored;
  for (const std::filesystem::path folder : {EMTB_SOURCE_CONFIG, EMTB_INSTALLED_CONFIG}) {
    if (std::filesystem::is_regular_file(folder / file, ignored)) return folder / file;
  }
  throw ConfigError("no " + file.string() +
                    " in " EMTB_SOURCE_CONFIG " or " EMTB_INSTALLED_CONFIG
                    ". Install emtb, or build it where its source lies");
}

}  // namespace emtb
