#include "analysis/check/stops_dead.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "analysis/check/readings.h"

namespace emtb {
namespace {

constexpr double at_speed = 0.6;  // of the fastest
constexpr double rests = 0.02;    // of that: what a brake leaves goes on for some rows

/// The rows that are at speed before one of rest.
std::vector<std::size_t> dead_stops(std::span<const double> speed, double fastest) {
  constexpr std::size_t stays = 5;  // rows
  std::vector<std::size_t> stops;
  for (std::size_t k = 0; k + stays < speed.size(); ++k) {
    const auto after = speed.subspan(k + 1, stays);
    const bool stands = std::ranges::all_of(after, [&](double v) { return std::abs(v) <= rests * fastest; });
    if (stands && std::abs(speed[k]) >= at_speed * fastest) stops.push_back(k);
  }
  return stops;
}

/// The fewest rows that it takes from rest to speed; none where it never does so.
std::optional<std::size_t> rows_to_speed(std::span<const double> speed, double fastest) {
  std::optional<std::size_t> fewest;
  std::size_t rested = 0;
  bool from_rest = false;
  for (std::size_t k = 0; k < speed.size(); ++k) {
    if (std::abs(speed[k]) <= rests * fastest) {
      rested = k;
      from_rest = true;
    } else if (from_rest && std::abs(speed[k]) >= at_speed * fastest) {
      fewest = std::min(fewest.value_or(speed.size()), k - rested);
      from_rest = false;
    }
  }
  return fewest;
}

}  // namespace

DataFindings stops_dead(const Run& run) {
  constexpr std::size_t often = 2, slowly = 3;  // rows: a shaft that is shorted or reversed stops as it starts
  if (!run.has(Signal::omega)) return {};
  const Series& speed = run.at(Signal::omega);
  const double fastest = size_of(speed.value);
  if (!(fastest > 0)) return {};
  const std::vector<std::size_t> stops = dead_stops(speed.value, fastest);
  const std::optional<std::size_t> rows = rows_to_speed(speed.value, fastest);
  if (stops.size() < often || !rows || *rows < slowly) return {};
  const std::size_t first = stops.front();
  return {{run.name, Signal::omega, Flaw::gap, speed.t[first], speed.t[stops.back() + 1],
           std::to_string(stops.size()) + " times the shaft rests one row after it turned, at " +
               short_number(speed.t[first + 1]) + " s after " + short_number(speed.value[first]) +
               " rad/s, though it takes " + std::to_string(*rows) +
               " rows to get there: are rows missing, or recordings put one behind the other? Split the file there, or "
               "name its runs in a column `run`",
           false}};
}

}  // namespace emtb
