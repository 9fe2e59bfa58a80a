#include "analysis/diagnose/comes_again.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>

#include "analysis/fit/residuals.h"

namespace emtb {
namespace {

/// What passes by itself tells no law.
bool passes(Condition c) { return c == Condition::time || c == Condition::heat; }

/// The sums of residuals by piece and bin, of one condition.
struct Table {
  std::vector<std::vector<double>> sums;  ///< [piece][bin], divided by the root of the bin's count
  double by_itself = 0;                   ///< sum of their squares

  /// What the pieces have in common, each with a sign.
  double in_common(std::span<const double> signs) const {
    double squares = 0;
    for (std::size_t b = 0; b < Bins::count; ++b) {
      double sum = 0;
      for (std::size_t p = 0; p < sums.size(); ++p) sum += signs[p] * sums[p][b];
      squares += sum * sum;
    }
    return squares - by_itself;
  }
};

Table table_of(const std::vector<ConditionedReading>& readings, std::size_t pieces) {
  Table table{std::vector<std::vector<double>>(pieces, std::vector<double>(Bins::count, 0.0)), 0};
  const Bins bins(readings);
  std::vector<double> counts(Bins::count, 0.0);
  for (const ConditionedReading& r : readings) {
    const std::size_t bin = bins.of(r.condition);
    table.sums[r.piece][bin] += r.scaled;
    counts[bin] += 1;
  }
  for (std::vector<double>& of_piece : table.sums) {
    for (std::size_t b = 0; b < Bins::count; ++b) {
      if (counts[b] > 0) of_piece[b] /= std::sqrt(counts[b]);
      table.by_itself += of_piece[b] * of_piece[b];
    }
  }
  return table;
}

/// The signs of one draw: all of them in turn where that takes no longer. One piece keeps its own.
std::vector<double> signs_of(std::size_t draw, std::size_t pieces, bool in_turn, std::mt19937& random) {
  std::vector<double> signs(pieces, 1.0);
  for (std::size_t p = 1; p < pieces; ++p) {
    const bool changed = in_turn ? ((draw >> (p - 1)) & 1U) != 0 : (random() & 1U) != 0;
    if (changed) signs[p] = -1;
  }
  return signs;
}

}  // namespace

ComingAgain coming_again(const ReadingsByCondition& readings) {
  constexpr std::size_t draws = 256;
  constexpr std::size_t seed = 1;  // the same data, the same answer
  std::size_t pieces = 0;
  double squares = 0;
  for (const ConditionedReading& r : readings[static_cast<std::size_t>(Condition::speed)]) {
    pieces = std::max(pieces, r.piece + 1);
    squares += r.scaled * r.scaled;
  }
  std::vector<Table> tables;
  for (std::size_t c = 0; c < condition_count; ++c) {
    if (!readings[c].empty() && !passes(static_cast<Condition>(c))) tables.push_back(table_of(readings[c], pieces));
  }
  if (tables.empty() || pieces < 2 || !(squares > 0)) return {};
  const auto largest = [&](std::span<const double> signs) {
    double most = 0;
    for (const Table& table : tables) most = std::max(most, table.in_common(signs));
    return most;
  };
  const std::vector<double> as_they_are(pieces, 1.0);
  ComingAgain found{largest(as_they_are) / squares, 0};
  const bool in_turn = pieces <= 9;
  const std::size_t tried = in_turn ? std::size_t{1} << (pieces - 1) : draws;
  std::mt19937 random(seed);
  std::size_t as_much = 1;  // as they are
  for (std::size_t draw = 1; draw < tried; ++draw) {
    if (largest(signs_of(draw, pieces, in_turn, random)) / squares >= found.share) ++as_much;
  }
  found.chance = static_cast<double>(as_much) / static_cast<double>(tried);
  return found;
}

std::map<Signal, ComingAgain> coming_again(const RecordRefs& records, const Model& model, const Memories& memory) {
  constexpr double forgotten = 5;    // times the memory: exp(-5)
  constexpr double of_shortest = 2;  // 64 pieces at most of an only run: more tell no more
  const double shortest = of_shortest * shortest_piece(records);
  const auto piece_of = [&](Signal signal) {
    const auto own = memory.find(signal);
    return own != memory.end() ? std::max(forgotten * own->second, shortest) : shortest;
  };
  std::map<Signal, ComingAgain> all;
  visit_readings_by_condition(records, model, piece_of, [&](Signal signal, const ReadingsByCondition& readings) {
    all.emplace(signal, coming_again(readings));
  });
  return all;
}

}  // namespace emtb
