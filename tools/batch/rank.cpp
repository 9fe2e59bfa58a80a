#include "tools/batch/rank.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <string_view>

#include "hal/error.h"

namespace emtb {
namespace {

std::optional<std::size_t> whole(std::string_view text) {
  std::size_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || text.empty()) return std::nullopt;
  return value;
}

struct Names {
  const char *number, *of, *first, *on_machine;
};

}  // namespace

Rank find_rank(const std::string& shard, const std::function<const char*(const char*)>& environment) {
  if (!shard.empty()) {
    const std::size_t slash = shard.find('/');
    const auto k = whole(shard.substr(0, slash));
    const auto n = slash == std::string::npos ? std::nullopt : whole(shard.substr(slash + 1));
    if (!k || !n || *k < 1 || *k > *n)
      throw Error("--shard takes K/N with K from 1 to N, such as 2/4, not `" + shard + "`");
    return {.number = *k - 1, .of = *n};
  }
  constexpr std::array<Names, 4> known{
      {{"OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE", "", "OMPI_COMM_WORLD_LOCAL_SIZE"},
       {"SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_COUNT", "SLURM_ARRAY_TASK_MIN", ""},
       {"SLURM_PROCID", "SLURM_NTASKS", "", ""},
       {"PMI_RANK", "PMI_SIZE", "", ""}}};
  const auto number = [&](const char* name) -> std::optional<std::size_t> {
    const char* text = *name == '\0' ? nullptr : environment(name);
    return text == nullptr ? std::nullopt : whole(text);
  };
  for (const Names& names : known) {
    const auto rank = number(names.number), of = number(names.of);
    if (!rank || !of || *of == 0) continue;
    const std::size_t first = number(names.first).value_or(0);
    return {.number = (*rank - std::min(first, *rank)) % *of,
            .of = *of,
            .on_machine = std::max<std::size_t>(1, number(names.on_machine).value_or(1))};
  }
  return {};
}

}  // namespace emtb
