#include "tools/rewrite.h"

#include <fstream>

#include "hal/error.h"
#include "session/replace.h"

namespace emtb {

void rewrite(const std::filesystem::path& file, const std::string& text) {
  const auto mode = std::filesystem::status(file).permissions();
  replace_file(file, [&](const std::filesystem::path& draft) {
    std::ofstream out(draft, std::ios::binary);
    out << text;
    out.flush();
    if (!out) throw SessionError(draft.string() + ": cannot be written");
    std::filesystem::permissions(draft, mode);
  });
}

}  // namespace emtb
