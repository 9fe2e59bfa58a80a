#include "drivers/sample_clock.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace emtb {
namespace {

constexpr double last_stretch = 8;   // [s] 64 of them: 8.5 minutes, in which a crystal keeps its temperature
constexpr std::size_t fewest = 8;    // stretches that a slope takes
constexpr double cautious = 3;       // standard errors of the slope that the offset may rise by
constexpr double resolution = 1e-6;  // [s] of an arrival
constexpr double wander = 1e-6;      // at least: what a crystal's temperature does in minutes

}  // namespace

void SampleClock::arrived(std::uint64_t n, double arrival) noexcept {
  const double x = static_cast<double>(n) * period_;
  const double passed = std::max(0.0, x - x_);
  offset_ += (slope_ + leak_) * passed;
  x_ = std::max(x_, x);
  offset_ = std::min(offset_, arrival - x + slope_ * (x_ - x));
  keep({x, arrival - x});
}

double SampleClock::time_of(std::uint64_t n) noexcept {
  const double x = static_cast<double>(n) * period_;
  last_ = std::max(x + offset_ + slope_ * (x - x_), last_ + period_ / 2);
  return last_;
}

ClockEstimate SampleClock::estimate() const noexcept {
  if (!std::isfinite(std_error_)) return {};
  return {.fast = 1 / (1 + slope_) - 1,
          .std_error = std_error_,
          .ahead = known_offset_ - offset_,
          .over = earliest_[count_ - 1].x - earliest_[0].x};
}

void SampleClock::keep(const Point& point) noexcept {
  if (count_ > 0 && point.x < end_) {
    if (height(point) < height(earliest_[count_ - 1])) earliest_[count_ - 1] = point;
    return;
  }
  fit();
  if (count_ == earliest_.size()) make_room();
  earliest_[count_++] = point;
  end_ = point.x + width_;
}

void SampleClock::make_room() noexcept {
  if (width_ >= last_stretch) {
    std::ranges::move(std::span(earliest_).subspan(1), earliest_.begin());
    --count_;
    return;
  }
  for (std::size_t i = 0; i < count_ / 2; ++i) {
    const Point &a = earliest_[2 * i], &b = earliest_[2 * i + 1];
    earliest_[i] = height(a) < height(b) ? a : b;
  }
  count_ /= 2;
  width_ *= 2;
}

void SampleClock::fit() noexcept {
  if (count_ < fewest) return;
  const std::span<const Point> points(earliest_.data(), count_);

  std::array<Point, 64> hull;
  std::size_t size = 0;
  for (const Point& p : points) {
    const auto turns_up = [&] {
      const Point &a = hull[size - 2], &b = hull[size - 1];
      return (b.x - a.x) * (p.y - a.y) > (b.y - a.y) * (p.x - a.x);
    };
    while (size >= 2 && !turns_up()) --size;
    hull[size++] = p;
  }
  double middle = 0;
  for (const Point& p : points) middle += p.x / static_cast<double>(count_);
  std::size_t right = 1;
  while (right + 1 < size && hull[right].x < middle) ++right;
  const Point &a = hull[right - 1], &b = hull[right];
  const double slope = std::clamp((b.y - a.y) / (b.x - a.x), -tolerance_, tolerance_);

  double lowest = std::numeric_limits<double>::infinity(), mean = 0;  // [s] of the points over a line of that slope
  for (const Point& p : points) {
    const double y = p.y - slope * p.x;
    lowest = std::min(lowest, y);
    mean += y / static_cast<double>(count_);
  }
  const double span = points.back().x - points.front().x;
  const double std_error = std::max(2 * (mean - lowest), resolution) / span;
  if (cautious * std_error > tolerance_) return;

  if (!std::isfinite(std_error_)) known_offset_ = offset_;
  slope_ = slope;
  std_error_ = std_error;
  leak_ = std::clamp(cautious * std_error, wander, tolerance_);
}

}  // namespace emtb
