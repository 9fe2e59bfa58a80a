#include "session/resolution.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace emtb {
namespace {

constexpr std::size_t enough =
    16384;  // values looked at: a grid shows in these, and sorting more takes longer than reading the file

/// Of sorted values, those that are nearer to the one before than that are the same.
void take_as_one(std::vector<double>& values, double same) {
  const auto [last, end] = std::ranges::unique(values, [same](double a, double b) { return b - a <= same; });
  values.erase(last, end);
}

std::vector<double> gaps_of(std::span<const double> values) {
  std::vector<double> gaps;
  for (std::size_t i = 1; i < values.size(); ++i) gaps.push_back(values[i] - values[i - 1]);
  return gaps;
}

constexpr double exactly = 1e-3, nearly = 0.15;  // of a step; on no grid: 0.29
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr int most_steps = 8;  // that the smallest gap may be

/// By how many steps readings are off a grid, rms; infinite where one lies on none.
double off_grid(std::span<const double> values, double step) {
  double squares = 0;
  for (const double value : values) {
    const double position = (value - values.front()) / step;
    const double miss = position - std::round(position);
    if (std::abs(miss) > 0.4) return infinity;
    squares += miss * miss;
  }
  return std::sqrt(squares / static_cast<double>(values.size()));
}

struct Grid {
  double step = 0;
  double steps = 0;  ///< from the lowest value to the highest
  double off = 0;    ///< of a step, rms
};

/// A grid of which the smallest gap is so many steps; none where some value lies on none. The step is the mean of the
/// gaps, each of which is one step or several; the smallest first, so that the estimate is good before it has to tell
/// seven steps from eight.
std::optional<Grid> grid_of(std::span<const double> values, std::span<const double> gaps, int smallest) {
  double sum = 0;
  Grid grid;
  for (const double gap : gaps) {
    grid.steps += sum == 0 ? smallest : std::round(gap * grid.steps / sum);
    sum += gap;
  }
  grid.step = sum / grid.steps;
  grid.off = off_grid(values, grid.step);
  return grid.off < infinity ? std::optional(grid) : std::nullopt;
}

double median(std::vector<double> x) {
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::ranges::nth_element(x, middle);
  return *middle;
}

}  // namespace

double resolution(std::span<const std::span<const double>> pieces, bool may_be_set) {
  std::size_t count = 0;
  std::size_t changes = 0;
  for (const auto& piece : pieces) {
    count += piece.size();
    for (std::size_t i = 1; i < piece.size(); ++i) changes += piece[i] != piece[i - 1] ? 1 : 0;
  }
  const std::size_t of_a_slow_meter = std::clamp<std::size_t>(count / 2, 6, 16);
  const bool rarely = changes < std::max(of_a_slow_meter, count / 100);
  if (rarely && (may_be_set || changes < of_a_slow_meter)) return 0;

  std::vector<double> values;
  const std::size_t stride = count / enough + 1;
  for (const auto& piece : pieces) {
    for (std::size_t i = 0; i < piece.size(); i += stride) values.push_back(piece[i]);
  }
  std::ranges::sort(values);
  // Arithmetic before the file was written may split a code in two, and so may the last digit of the text.
  constexpr double of_the_range = 1e-9, of_a_gap = 1e-4;
  take_as_one(values, of_the_range * (values.back() - values.front()));
  if (values.size() < 4) return 0;
  take_as_one(values, of_a_gap * median(gaps_of(values)));
  if (values.size() < 4) return 0;

  std::vector<double> gaps = gaps_of(values);
  std::ranges::sort(gaps);
  for (int smallest = 1; smallest <= most_steps; ++smallest) {
    const std::optional<Grid> grid = grid_of(values, gaps, smallest);
    if (!grid) continue;
    if (grid->off < exactly && (smallest == 1 || values.size() >= 8)) return grid->step;
    if (rarely || grid->off >= nearly) continue;
    const bool gapless = grid->steps == static_cast<double>(gaps.size());
    const std::size_t enough_values = smallest > 1 ? 32 : gapless ? 5 : 8;
    if (values.size() >= enough_values) return grid->step;
  }
  return 0;
}

bool lies_on_grid(std::span<const double> values, double step) {
  return !values.empty() && off_grid(values, step) < nearly;
}

}  // namespace emtb
