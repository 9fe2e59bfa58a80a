#include "analysis/check/duplicate.h"

#include <bit>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <unordered_set>

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

/// Of some blocks those that come once in their run: coarse counts of a steady speed repeat themselves.
void leave_out_what_recurs(std::vector<std::optional<std::uint64_t>>& blocks) {
  std::unordered_map<std::uint64_t, int> times;
  for (const auto& b : blocks) {
    if (b) ++times[*b];
  }
  for (auto& b : blocks) {
    if (b && times[*b] > 1) b.reset();
  }
}

struct Listed {
  const Run* run = nullptr;
  bool held_out = false;
  std::size_t rows = 0;
  std::vector<std::optional<std::uint64_t>> blocks;  ///< from every row on
  std::unordered_set<std::uint64_t> known;           ///< the same, to look up
};

Listed listed(const Run& run, bool held_out) {
  const std::vector<std::uint64_t> rows = rows_of(run);
  Listed l{&run, held_out, rows.size(), blocks_of(rows), {}};
  leave_out_what_recurs(l.blocks);
  for (const auto& b : l.blocks) {
    if (b) l.known.insert(*b);
  }
  return l;
}

struct Shared {
  std::size_t of = 0, same = 0, first = 0, last = 0;
};

Shared shared(const Listed& a, const Listed& b) {
  Shared s;
  for (std::size_t k = 0; k < b.blocks.size(); k += block) {
    if (!b.blocks[k]) continue;
    ++s.of;
    if (!a.known.contains(*b.blocks[k])) continue;
    if (s.same == 0) s.first = k;
    ++s.same;
    s.last = k + block - 1;
  }
  return s;
}

}  // namespace

DataFindings duplicates(std::span<const Run> train, std::span<const Run> held_out) {
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
        if (series.t.size() == all[b].rows) from = series.t[s.first], to = series.t[s.last];
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
