#include "analysis/record/terminal_lateness.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <vector>

#include "analysis/numerics/even_series.h"
#include "analysis/numerics/linear_algebra.h"
#include "analysis/numerics/parabola.h"
#include "analysis/numerics/parallel.h"
#include "analysis/record/driver_voltage.h"
#include "analysis/record/reference_row.h"

namespace emtb {
namespace {

constexpr std::size_t parts = 8;  // of a row, in which a voltage is looked at and edges may come earlier

/// What is left of y = c_0 + c_1 a + c_2 b, summed as it comes.
class Plane {
 public:
  void add(double y, double a, double b) {
    const Eigen::Vector3d x(1, a, b);
    xx_ += x * x.transpose();
    xy_ += y * x;
    yy_ += y * y;
    ++count_;
  }
  double squares_left() const {
    const Eigen::MatrixXd c = solve_normal(xx_, Eigen::MatrixXd(xy_));
    return std::max(0.0, yy_ - xy_.dot(c.col(0)));
  }
  double count() const { return count_; }

 private:
  Eigen::Matrix3d xx_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d xy_ = Eigen::Vector3d::Zero();
  double yy_ = 0, count_ = 0;
};

/// A driver's voltage between the rows, as a model foretells it.
class Voltage {
 public:
  /// @param acts_after [s]
  Voltage(const Series& reference, const Model& model, double start, double acts_after) {
    Excitation x;
    std::vector<double> t, u;
    for (std::size_t k = 0; k + 1 < reference.t.size(); ++k) {
      for (std::size_t p = 0; p < parts; ++p) {
        t.push_back(std::lerp(reference.t[k], reference.t[k + 1], static_cast<double>(p) / parts));
        u.push_back(reference.value[k]);
      }
    }
    t.push_back(reference.t.back());
    u.push_back(reference.value.back());
    x.t = std::move(t);
    x.u_ref = std::move(u);
    x.initial.e_driver = start;
    const double part = mean_interval(x.t);
    x.rows_early = static_cast<std::size_t>(std::max(0.0, -acts_after / part));
    x.acts_after = acts_after + static_cast<double>(x.rows_early) * part;
    value_ = driver_voltage(model, model.values(), x);
  }

  double at_row(std::size_t k) const { return value_[k * parts]; }

  /// The mean over the row that ends at row k.
  double over(std::size_t k) const {
    double sum = 0;
    for (std::size_t i = (k - 1) * parts; i < k * parts; ++i) sum += 0.5 * (value_[i] + value_[i + 1]);
    return sum / parts;
  }

  /// What the change of the mean speed, from the row that ends at row k to the next, sees of it: each moment as long
  /// as it has acted.
  double between_means(std::size_t k) const {
    double sum = 0;
    for (std::size_t i = (k - 1) * parts; i < (k + 1) * parts; ++i) {
      const double middle = static_cast<double>(i) + 0.5 - static_cast<double>(k * parts);
      sum += (1 - std::abs(middle) / parts) * 0.5 * (value_[i] + value_[i + 1]);
    }
    return sum / parts;
  }

 private:
  std::vector<double> value_;
};

void add_current(Plane& plane, const std::vector<double>& i_a, const Voltage& e) {
  for (std::size_t k = 1; k < i_a.size(); ++k)
    plane.add(i_a[k] - i_a[k - 1], e.at_row(k) - e.at_row(k - 1), 0.5 * (i_a[k] + i_a[k - 1]));
}

void add_speed(Plane& plane, const std::vector<double>& omega, const Voltage& e) {
  for (std::size_t k = 1; k < omega.size(); ++k)
    plane.add(omega[k] - omega[k - 1], e.over(k), 0.5 * (omega[k] + omega[k - 1]));
}

void add_angle(Plane& plane, const std::vector<double>& theta, const Voltage& e) {
  for (std::size_t k = 1; k + 1 < theta.size(); ++k) {
    const double before = theta[k] - theta[k - 1], after = theta[k + 1] - theta[k];
    plane.add(after - before, e.between_means(k), 0.5 * (after + before));
  }
}

void add(Plane& plane, Signal signal, const std::vector<double>& readings, const Voltage& e) {
  if (signal == Signal::i_a) add_current(plane, readings, e);
  if (signal == Signal::omega) add_speed(plane, readings, e);
  if (signal == Signal::theta) add_angle(plane, readings, e);
}

/// What each signal leaves, where the edges come by so many parts of a row earlier than the terminals show them.
using Planes = std::array<Plane, parts + 1>;

std::map<Signal, Planes> planes_of(std::span<const Run> runs, const Model& model, double acts_after) {
  std::map<Signal, Planes> planes{{Signal::i_a, {}}, {Signal::omega, {}}, {Signal::theta, {}}};
  parallel_for(parts + 1, [&](std::size_t earlier) {
    for (const Run& run : runs) {
      if (!drives_the_motor(run, model)) continue;
      const Series& reference = run.at(Signal::u_ref);
      const double by = static_cast<double>(earlier) / parts * mean_interval(reference.t);
      const Voltage voltage(reference, model, run.at(Signal::e_a).value.front(), acts_after - by);
      for (auto& [signal, of] : planes) {
        if (read_in_every_row(run, signal, model)) add(of[earlier], signal, run.at(signal).value, voltage);
      }
    }
  });
  return planes;
}

/// [rows] Where the terminals tell the edges; none where no reference drives the runs.
std::optional<double> rows_after(std::span<const Run> runs, const Model& model, double acts_after) {
  if (runs.empty() || model.input != Signal::u_ref || !runs.front().has(Signal::u_ref)) return std::nullopt;
  return acts_after / mean_interval(runs.front().at(Signal::u_ref).t);
}

/// By which part of a row a signal tells that the edges come earlier; none where it does not.
/// @param much of the sum of squares is left at most
std::optional<double> told_by(std::span<const Plane> planes, double much = 0.8) {
  constexpr double clear = 20;  // of the sum of squares: a nuisance is free, but not for a crumb
  std::vector<double> squares;
  for (const Plane& plane : planes) squares.push_back(plane.squares_left());
  const auto place = static_cast<std::size_t>(std::ranges::min_element(squares) - squares.begin());
  const double least = squares[place], now = squares.front(), count = planes.front().count();
  if (count == 0 || place == 0 || least > much * now || (now / least - 1) * count < clear) return std::nullopt;
  if (place + 1 == squares.size()) return 1;
  return (static_cast<double>(place) + lowest_about(squares[place - 1], least, squares[place + 1])) / parts;
}

}  // namespace

double terminals_are_late(std::span<const Run> runs, const Model& model, double acts_after) {
  constexpr double amid = 0.05, near = 0.15;  // of a row
  const std::optional<double> rows = rows_after(runs, model, acts_after);
  if (!rows || std::abs(*rows) < amid || std::abs(*rows) > 1 - amid) return 0;  // no edge was seen amid a row
  double late = 0;
  for (const auto& [signal, planes] : planes_of(runs, model, acts_after))
    late = std::max(late, told_by(planes).value_or(0));
  // A row is read before it is written or after: edges that come nearly with it do.
  const double with_its_row = *rows > 0 ? *rows : *rows + 1;
  return late > 0 && std::abs(late - with_its_row) < near ? with_its_row : late;
}

double edges_come_early(std::span<const Run> runs, const Model& model, double acts_after) {
  constexpr double with_a_row = 0.05, nearly_all = 0.75;  // of a row
  constexpr double hardly_less = 0.97;                    // many rows of noise hold a few edges
  const std::optional<double> rows = rows_after(runs, model, acts_after);
  if (!rows || *rows >= 0 || *rows < -with_a_row) return 0;
  double early = 0;
  bool all = false;
  for (const auto& [signal, planes] : planes_of(runs, model, acts_after)) {
    if (signal == Signal::i_a) continue;  // with which the terminals go, whenever the edge came
    early = std::max(early, told_by(planes).value_or(0));
    all = all || told_by(planes, hardly_less).value_or(0) > nearly_all;
  }
  return all ? 1 : early;
}

}  // namespace emtb
