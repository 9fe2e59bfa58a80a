#include "analysis/check/duplicate.h"

#include <bit>
#include <cstdint>
#include <unordered_map>
#include <unordered_set>

#include "analysis/check/readings.h"

namespace emtb {
namespace {

constexpr std::size_t block = 50;    // rows that are compared together
constexpr std::size_t varied = 10;   // different rows among them, at least: a standstill repeats itself

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

/// One number for block rows from k on, if they vary enough to tell runs apart.
std::optional<std::uint64_t> block_at(const std::vector<std::uint64_t>& rows, std::size_t k) {
  std::uint64_t sum = 0;
  std::unordered_set<std::uint64_t> different;
  for (std::size_t i = k; i < k + block; ++i) {
    sum = (sum ^ rows[i]) * 0x9E3779B97F4A7C15u;
    sum ^= sum >> 31;
    different.insert(rows[i]);
  }
  return different.size() >= varied ? std::optional(sum) : std::nullopt;
}

struct Listed {
  const Run* run = nullptr;
  bool held_out = false;
  std::vector<std::uint64_t> rows;
  std::size_t blocks = 0;                     ///< that tell it from others
  std::unordered_set<std::uint64_t> at_each;  ///< the blocks from every row on
};

Listed listed(const Run& run, bool held_out) {
  Listed l{&run, held_out, rows_of(run), 0, {}};
  for (std::size_t k = 0; k + block <= l.rows.size(); ++k) {
    if (const auto sum = block_at(l.rows, k)) l.at_each.insert(*sum);
  }
  return l;
}

struct Shared {
  std::size_t of = 0, same = 0, first = 0, last = 0;
};

Shared shared(const Listed& a, const Listed& b) {
  Shared s;
  for (std::size_t k = 0; k + block <= b.rows.size(); k += block) {
    const auto sum = block_at(b.rows, k);
    if (!sum) continue;
    ++s.of;
    if (!a.at_each.contains(*sum)) continue;
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
        if (series.t.size() == all[b].rows.size()) from = series.t[s.first], to = series.t[s.last];
      }
      const bool twice = all[a].run->name == all[b].run->name;
      const std::string text =
          twice ? (across ? "is given for training and as held out" : "is listed twice")
                : (across ? "holds readings of " + all[a].run->name + ", which is given for training"
                          : "holds the readings of " + all[a].run->name);
      findings.push_back({all[b].run->name, {}, Flaw::duplicate, from, to,
                          text + (across ? ": a run that judges must not be fitted; leave one of them out"
                                         : ": it would count twice; leave one of them out"),
                          true});
      break;
    }
  }
  return findings;
}

}  // namespace emtb
