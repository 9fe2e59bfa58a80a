#include "analysis/check/duplicate.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "analysis/check/readings.h"

namespace emtb {
namespace {

constexpr std::size_t block = 50;   // rows that are compared together
constexpr std::size_t varied = 10;  // changes among them, at least: a standstill repeats itself

/// The rows of a run as numbers that are the same where all readings are.
std::vector<std::uint64_t> rows_of(const Run& run) {
  const Series* longest = nullptr;
  for (const auto& [signal, series] : run.signals) {
    if (!longest || series.t.size() > longest->t.size()) longest = &series;
  }
  std::vector<std::uint64_t> rows(longest ? longest->t.size() : 0, 1469598103934665603u);
  for (const auto& [signal, series] : run.signals) {
    if (series.t.size() != rows.size()) continue;
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const double value = series.value[k] + 0.0;  // -0 is 0
      rows[k] = (rows[k] ^ (std::bit_cast<std::uint64_t>(value) + signal_count + index(signal))) * 1099511628211u;
      rows[k] ^= rows[k] >> 29;
    }
  }
  return rows;
}

/// One number for each `block` rows, from every row on: a polynomial, which goes on from the one before it. None where
/// they hardly vary.
std::vector<std::optional<std::uint64_t>> blocks_of(const std::vector<std::uint64_t>& rows) {
  constexpr std::uint64_t base = 0x9E3779B97F4A7C15u;
  std::uint64_t highest = 1;  // base to the power of block
  for (std::size_t i = 0; i < block; ++i) highest *= base;
  std::vector<std::optional<std::uint64_t>> blocks;
  std::uint64_t sum = 0;
  std::size_t changes = 0;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    sum = sum * base + rows[k];
    if (k > 0 && rows[k] != rows[k - 1]) ++changes;
    if (k >= block) {
      sum -= highest * rows[k - block];
      if (rows[k - block + 1] != rows[k - block]) --changes;
    }
    if (k + 1 >= block) blocks.push_back(changes >= varied ? std::optional(sum) : std::nullopt);
  }
  return blocks;
}

struct Listed {
  const Run* run = nullptr;
  bool held_out = false;
  std::vector<std::uint64_t> rows;
  std::vector<std::optional<std::uint64_t>> blocks;           ///< from every row on, where it comes once
  std::vector<std::pair<std::uint64_t, std::size_t>> sorted;  ///< the same with their rows, to look up

  /// The row from which on this block comes.
  std::optional<std::size_t> row_of(std::uint64_t number) const {
    const auto at = std::ranges::lower_bound(sorted, number, {}, [](const auto& entry) { return entry.first; });
    return at != sorted.end() && at->first == number ? std::optional(at->second) : std::nullopt;
  }
};

/// Coarse counts of a steady speed repeat themselves: a block that comes more than once says nothing.
void leave_out_what_recurs(Listed& l) {
  auto kept = l.sorted.begin();
  for (auto first = l.sorted.begin(); first != l.sorted.end();) {
    const auto end = std::find_if(first, l.sorted.end(), [&](const auto& e) { return e.first != first->first; });
    if (end - first == 1) {
      *kept++ = *first;
    } else {
      for (auto again = first; again != end; ++again) l.blocks[again->second].reset();
    }
    first = end;
  }
  l.sorted.erase(kept, l.sorted.end());
}

Listed listed(const Run& run, bool held_out) {
  Listed l{&run, held_out, rows_of(run), {}, {}};
  l.blocks = blocks_of(l.rows);
  for (std::size_t k = 0; k < l.blocks.size(); ++k) {
    if (l.blocks[k]) l.sorted.emplace_back(*l.blocks[k], k);
  }
  std::ranges::sort(l.sorted);
  leave_out_what_recurs(l);
  return l;
}

/// A stretch in which the rows of two runs agree.
struct Agreement {
  std::ptrdiff_t shift = 0;  ///< from the rows of one to those of the other
  std::ptrdiff_t end = 0;    ///< in the other
  bool repeated = false;     ///< by an experiment that was made again, with noise below the instruments' steps
};

/// Where readings are copied, the rows around them are the same or have nothing to do with each other. Those of an
/// experiment that was repeated agree in most of them, and not in all.
/// @param in_a, in_b from where on both agree over a block
Agreement agreement(std::span<const std::uint64_t> a, std::span<const std::uint64_t> b, std::size_t in_a,
                    std::size_t in_b) {
  Agreement found{.shift = static_cast<std::ptrdiff_t>(in_b) - static_cast<std::ptrdiff_t>(in_a)};
  const auto inside = [&](std::ptrdiff_t j) {
    return j >= 0 && j < std::ssize(b) && j - found.shift >= 0 && j - found.shift < std::ssize(a);
  };
  const auto same = [&](std::ptrdiff_t j) {
    return a[static_cast<std::size_t>(j - found.shift)] == b[static_cast<std::size_t>(j)];
  };
  const auto changes = [&](std::span<const std::uint64_t> rows, std::ptrdiff_t k) {
    return k > 0 && rows[static_cast<std::size_t>(k)] != rows[static_cast<std::size_t>(k) - 1];
  };
  for (const int step : {-1, 1}) {
    auto j = static_cast<std::ptrdiff_t>(in_b);
    while (inside(j) && same(j)) j += step;
    found.end = j;  // the last time, forward
    std::size_t seen = 0, agreed = 0;
    for (std::size_t n = 0; n < block && inside(j); ++n, j += step) {
      if (!changes(a, j - found.shift) && !changes(b, j)) continue;
      ++seen;
      agreed += same(j) ? 1 : 0;
    }
    found.repeated = found.repeated || (seen >= varied && 2 * agreed > seen);
  }
  return found;
}

struct Shared {
  std::size_t of = 0, same = 0, first = 0, last = 0;
};

Shared shared(const Listed& a, const Listed& b) {
  Shared s;
  std::optional<Agreement> last;  // which many blocks may lie in: as long as a run
  for (std::size_t k = 0; k < b.blocks.size(); k += block) {
    if (!b.blocks[k]) continue;
    ++s.of;
    const std::optional<std::size_t> there = a.row_of(*b.blocks[k]);
    if (!there) continue;
    const auto at = static_cast<std::ptrdiff_t>(k);
    if (!last || at >= last->end || at - last->shift != static_cast<std::ptrdiff_t>(*there))
      last = agreement(a.rows, b.rows, *there, k);
    if (last->repeated) continue;
    if (s.same == 0) s.first = k;
    ++s.same;
    s.last = k + block - 1;
  }
  return s;
}

}  // namespace

DataFindings duplicates(std::span<const Run> train, std::span<const Run> held_out) {
  if (train.size() + held_out.size() < 2) return {};
  std::vector<Listed> all;
  for (const Run& run : train) all.push_back(listed(run, false));
  for (const Run& run : held_out) all.push_back(listed(run, true));
  DataFindings findings;
  for (std::size_t b = 1; b < all.size(); ++b) {
    for (std::size_t a = 0; a < b; ++a) {
      const Shared s = shared(all[a], all[b]), back = shared(all[b], all[a]);
      const bool across = all[a].held_out != all[b].held_out;
      // Either is in the other by half; a tenth is enough to spoil a judgement by runs that no fit has seen.
      const std::size_t share = across ? 10 : 2;
      const auto enough = [&](const Shared& of) { return of.same > 0 && share * of.same >= of.of; };
      if (!enough(s) && !enough(back)) continue;
      double from = 0, to = all[b].run->duration();
      for (const auto& [signal, series] : all[b].run->signals) {
        if (series.t.size() == all[b].rows.size()) from = series.t[s.first], to = series.t[s.last];
      }
      const bool twice = all[a].run->name == all[b].run->name;
      const std::string text = twice
                                   ? (across ? "is given for training and as held out" : "is listed twice")
                                   : (across ? "holds readings of " + all[a].run->name + ", which is given for training"
                                             : "holds the readings of " + all[a].run->name);
      findings.push_back({all[b].run->name,
                          {},
                          Flaw::duplicate,
                          from,
                          to,
                          text + (across ? ": a run that judges must not be fitted; leave one of them out"
                                         : ": it would count twice; leave one of them out"),
                          true});
      break;
    }
  }
  return findings;
}

}  // namespace emtb
