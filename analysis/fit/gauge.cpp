#include "analysis/fit/gauge.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "analysis/fit/calibrate.h"
#include "analysis/fit/normal_equations.h"
#include "analysis/fit/typical_size.h"
#include "analysis/numerics/linear_algebra.h"
#include "model/effect.h"

namespace emtb {
namespace {

constexpr double factor_of_ten = std::numbers::ln10;  // of the logarithm
constexpr double rounding = 1e-7;                     // of the strongest direction: lost in the arithmetic
constexpr double takes_part = 0.1;                    // of a direction's square; by hand
constexpr double goes_with = 0.1;                     // of a change in the pin; by hand
constexpr std::size_t no_rank = 99;

/// SᵀS of the free parameters (and priors), each in units of its size.
struct Information {
  std::vector<std::size_t> places;
  Eigen::VectorXd size;
  Eigen::MatrixXd scaled;
};

Information information_of(std::span<const Record> records, const Model& model) {
  const CalibrationOptions options;
  const FitProblem problem(records, model, options);
  const auto places = problem.free().places();
  Information info{{places.begin(), places.end()}, Eigen::VectorXd(static_cast<Eigen::Index>(places.size())), {}};
  for (std::size_t i = 0; i < places.size(); ++i) {
    info.size[static_cast<Eigen::Index>(i)] = natural_size(model, model, places[i]);
  }
  const Eigen::MatrixXd sts = problem.normal_equations(problem.free().pick({}), true, false).sts;
  info.scaled = info.size.asDiagonal() * sts * info.size.asDiagonal();
  return info;
}

/// The directions, one a column, along which the logarithm of the parameters is not known to that much.
Eigen::MatrixXd null_directions(const Eigen::MatrixXd& scaled, double log_error = factor_of_ten) {
  if (scaled.size() == 0) return {};
  const Eigensystem eigen = eigensystem(scaled);
  const double largest = std::sqrt(std::max(0.0, eigen.values.maxCoeff()));
  Eigen::Index count = 0;
  while (count < eigen.values.size()) {
    const double singular = std::sqrt(std::max(0.0, eigen.values[count]));
    if (singular * log_error >= 1 && singular > rounding * largest) break;
    ++count;
  }
  return eigen.vectors.leftCols(count);
}

/// The order in which parameters are held that take part in a direction alike. B first: it does so only where it adds
/// to what K_b does, since that is asked where B is nothing.
std::size_t rank(std::size_t place) {
  constexpr std::array order{base::B, base::R_a, base::K_m, base::J, base::K_b};
  return static_cast<std::size_t>(std::ranges::find(order, place) - order.begin());
}

/// Holds one parameter after the other, until no null direction is left.
std::vector<std::size_t> chosen(const Information& info, std::size_t most) {
  std::vector<Eigen::Index> left;
  for (std::size_t i = 0; i < info.places.size(); ++i) left.push_back(static_cast<Eigen::Index>(i));
  std::vector<std::size_t> held;
  while (held.size() < most) {
    const Eigen::MatrixXd null = null_directions(info.scaled(left, left));
    if (null.cols() == 0) break;
    std::optional<std::size_t> best;  // in `left`
    double share = 0;
    for (std::size_t i = 0; i < left.size(); ++i) {
      const std::size_t place = info.places[static_cast<std::size_t>(left[i])];
      const double part = null.row(static_cast<Eigen::Index>(i)).squaredNorm();
      if (part < takes_part) continue;
      const std::size_t best_rank = best ? rank(info.places[static_cast<std::size_t>(left[*best])]) : no_rank;
      if (rank(place) < best_rank || (rank(place) == best_rank && part > share)) {
        best = i;
        share = part;
      }
    }
    if (!best) break;
    held.push_back(info.places[static_cast<std::size_t>(left[*best])]);
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(*best));
  }
  return held;
}

void pin(Parameter& p, double value) {
  p.value = value;
  p.fixed = p.pinned = true;
}

/// Is a parameter that has a size of its own as good as at a bound?
bool crowded(const Model& model) {
  const FreeParameters free(model);
  return std::ranges::any_of(free.places(), [&](std::size_t place) {
    const Parameter& p = model.at(place);
    if (place >= ModelStructure::base_count || p.min <= 0) return false;
    const double room = std::min(std::numbers::ln2, 0.1 * std::log(p.max / p.min));
    return std::log(p.value / p.min) < room || std::log(p.max / p.value) < room;
  });
}

/// Values to try, the nearest to that given first. What may be nothing is held at nothing: then K_b stands for all that
/// it is told from, and none of the rest depends on the other pins but by a factor.
std::vector<double> values_to_try(const Parameter& given, const Parameter& fitted) {
  if (given.min <= 0) return {std::clamp(0.0, given.min, given.max), given.value, fitted.value};
  std::vector<double> values{given.value};
  for (const double factor : {3.0, 10.0, 30.0, 100.0, 1000.0}) {
    for (const double value : {given.value * factor, given.value / factor}) {
      if (value >= given.min && value <= given.max) values.push_back(value);
    }
  }
  values.push_back(fitted.value);
  return values;
}

/// [1] Of the cost: what is within the tolerance of a search's descents is no loss.
constexpr double no_loss = 1e-3;

Fit fit_with_pin(std::span<const Record> records, const Model& given, const Model& fitted, std::size_t place,
                 double value) {
  const CalibrationOptions quick{.extra_starts = 0, .max_iterations = 25, .tolerance = 1e-5, .with_covariance = false};
  Model from_given = given, from_fitted = fitted;
  pin(from_given.at(place), value);
  pin(from_fitted.at(place), value);
  const Fit a = fit_or_none(records, from_given, quick), b = fit_or_none(records, from_fitted, quick);
  return a.cost <= b.cost ? a : b;
}

}  // namespace

std::vector<std::size_t> places_to_hold(std::span<const Record> records, const Model& fitted) {
  const Information there = information_of(records, fitted);
  const auto open = static_cast<std::size_t>(null_directions(there.scaled).cols());
  if (open == 0) return {};
  // Along a factor that is free B goes as the torques do, as much as there is of it. Where there is none it takes part
  // only in what is a sum with it. Held in place of such a factor, a B that is really nothing would drive all others
  // to their bounds.
  Model without_B = fitted;
  if (Parameter& B = without_B.at(base::B); !B.fixed && B.min <= 0) B.value = 0;
  return chosen(information_of(records, without_B), open);
}

bool carried_along(std::span<const Record> records, const Model& fitted, std::size_t place) {
  const Information info = information_of(records, fitted);
  const auto at = std::ranges::find(info.places, place);
  if (at == info.places.end()) return false;
  const Eigen::Index i = at - info.places.begin();
  const bool told_by_itself = std::sqrt(info.scaled(i, i)) * factor_of_ten >= 1;
  return told_by_itself && null_directions(info.scaled).row(i).squaredNorm() >= takes_part;
}

Model hold(std::span<const Record> records, const Model& given, const Model& fitted,
           std::span<const std::size_t> places) {
  Model held = given, at = fitted;
  const CalibrationOptions as_it_is{.extra_starts = 0, .max_iterations = 0, .with_covariance = false};
  double cost = fit_or_none(records, fitted, as_it_is).cost;
  for (const std::size_t place : places) {
    Fit best{.model = at, .cost = infinity};
    double value = given.at(place).value;
    for (const double candidate : values_to_try(given.at(place), at.at(place))) {
      const Fit there = fit_with_pin(records, held, at, place, candidate);
      if (there.cost < best.cost * (1 - no_loss)) {
        best = there;
        value = candidate;
      }
      if (there.cost <= cost * (1 + no_loss) && !crowded(there.model)) {
        best = there;
        value = candidate;
        break;
      }
    }
    pin(held.at(place), value);
    at = best.model;
    cost = std::min(cost, best.cost);
  }
  return held;
}

std::optional<Model> held_nearer(std::span<const Record> records, const Model& given, const Model& fitted) {
  const CalibrationOptions as_it_is{.extra_starts = 0, .max_iterations = 0, .with_covariance = false};
  std::optional<Model> nearer;
  Model at = fitted;
  double cost = fit_or_none(records, fitted, as_it_is).cost;
  for (std::size_t place = 0; place < ModelStructure::base_count; ++place) {
    if (!fitted.at(place).pinned) continue;
    for (const double candidate : values_to_try(given.at(place), fitted.at(place))) {
      if (candidate == at.at(place).value) break;  // those that follow are farther
      const Fit there = fit_with_pin(records, at, at, place, candidate);
      if (there.cost > cost * (1 + no_loss) || crowded(there.model)) continue;
      cost = std::min(cost, there.cost);
      nearer = at = there.model;
      break;
    }
  }
  return nearer;
}

Model without_pins(Model model) {
  for (std::size_t i = 0; i < model.names().size(); ++i) {
    Parameter& p = model.at(i);
    if (p.pinned) p.fixed = p.pinned = false;
  }
  return model;
}

bool told(std::span<const Record> records, const Model& fitted, std::size_t place) {
  constexpr double enough = 0.3;  // of its size: as calibrate() calls a parameter determined
  const auto open = [&](const Model& model) {
    return null_directions(information_of(records, model).scaled, enough).cols();
  };
  Model held = fitted;
  held.at(place).fixed = true;
  // What ends on a bound is no part of a covariance, and seems to tell the rest.
  if (open(fitted) > open(held)) return false;
  CalibrationOptions as_it_is{.extra_starts = 0, .max_iterations = 0};
  as_it_is.quick_errors = true;
  const std::optional<double> error = fit_or_none(records, fitted, as_it_is).model.at(place).std_error;
  return error && *error < enough * natural_size(fitted, fitted, place);
}

std::optional<Model> with_told_pins_free(std::span<const Record> records, const Model& fitted) {
  Model freed = fitted;
  bool any = false;
  for (std::size_t place = 0; place < fitted.names().size(); ++place) {
    if (!fitted.at(place).pinned) continue;
    Model free = freed;
    free.at(place).fixed = free.at(place).pinned = false;
    if (!told(records, free, place)) continue;
    freed = std::move(free);
    any = true;
  }
  return any ? std::optional(freed) : std::nullopt;
}

std::optional<Model> with_pins_elsewhere(std::span<const Record> records, const Model& fitted) {
  std::vector<std::size_t> pinned;
  for (std::size_t place = 0; place < fitted.names().size(); ++place) {
    if (fitted.at(place).pinned) pinned.push_back(place);
  }
  Model elsewhere = without_pins(fitted);
  std::vector<std::size_t> places = places_to_hold(records, elsewhere);
  std::ranges::sort(places);
  if (places == pinned || places.size() != pinned.size()) return std::nullopt;
  for (const std::size_t place : places) pin(elsewhere.at(place), elsewhere.at(place).value);
  return elsewhere;
}

namespace {

/// How the others go with one parameter that is held: d(parameter) for a change of it, each in units of its size.
struct Slopes {
  std::vector<std::size_t> places;
  std::vector<double> size, slope;
  double own_size = 0;
  double information = 0;  ///< on the held one, once the others have followed, per size^2
};

Slopes slopes_of(std::span<const Record> records, const Model& fitted, std::size_t place) {
  Model free = fitted;
  free.at(place).fixed = false;
  const Information info = information_of(records, free);
  const auto own = static_cast<Eigen::Index>(std::ranges::find(info.places, place) - info.places.begin());
  std::vector<Eigen::Index> others;
  for (Eigen::Index i = 0; i < info.size.size(); ++i) {
    const Parameter& other = fitted.at(info.places[static_cast<std::size_t>(i)]);
    if (i != own && other.value != 0 && info.scaled(i, i) > 0) others.push_back(i);
  }
  Slopes slopes;
  slopes.own_size = info.size[own];
  slopes.information = info.scaled(own, own);
  if (others.empty()) return slopes;
  const Eigen::VectorXd column = info.scaled(others, Eigen::all).col(own);
  const Eigen::VectorXd slope = -solve_normal(info.scaled(others, others), column);
  slopes.information += column.dot(slope);
  for (std::size_t k = 0; k < others.size(); ++k) {
    slopes.places.push_back(info.places[static_cast<std::size_t>(others[k])]);
    slopes.size.push_back(info.size[others[k]]);
    slopes.slope.push_back(slope[static_cast<Eigen::Index>(k)]);
  }
  return slopes;
}

}  // namespace

std::vector<Pin> pins_of(std::span<const Record> records, const Model& fitted) {
  const std::vector<std::string> names = fitted.names();
  std::vector<Pin> pins;
  const bool current_read = fitted.input == Signal::i_a || std::ranges::any_of(records, [](const Record& r) {
                              return r.find(Signal::i_a) != nullptr;
                            });
  for (std::size_t place = 0; place < names.size(); ++place) {
    if (!fitted.at(place).pinned) continue;
    Pin p{place, names[place], fitted.at(place).value, fitted.at(place).unit, {}, current_read};
    const Slopes slopes = slopes_of(records, fitted, place);
    for (std::size_t k = 0; k < slopes.places.size(); ++k) {
      const std::size_t at = slopes.places[k];
      const double power = slopes.slope[k] * slopes.size[k] / fitted.at(at).value;
      if (std::abs(power) >= goes_with) p.followers.push_back({names[at], power});
    }
    pins.push_back(std::move(p));
  }
  return pins;
}

void widen_by_held_damping(std::span<const Record> records, const Model& given, Model& fitted) {
  const Parameter& B = fitted.at(base::B);
  if (!B.pinned) return;
  const Slopes slopes = slopes_of(records, fitted, base::B);
  constexpr double two_sided = 1.96;  // errors to 95 %
  constexpr double a_guess = 3;       // is right within that factor
  const double farthest = std::max(B.value, a_guess * given.at(base::B).value - B.value);
  const double error_of_B = farthest / two_sided / slopes.own_size;
  for (std::size_t k = 0; k < slopes.places.size(); ++k) {
    std::optional<double>& error = fitted.at(slopes.places[k]).std_error;
    if (error) error = std::hypot(*error, slopes.slope[k] * slopes.size[k] * error_of_B);
  }
}

std::vector<std::string> scaled_with(std::span<const Pin> pins, const std::string& parameter) {
  std::vector<std::string> with;
  for (const Pin& pin : pins) {
    if (std::ranges::find(pin.followers, parameter, &Follower::parameter) != pin.followers.end()) {
      with.push_back(pin.parameter);
    }
  }
  return with;
}

}  // namespace emtb
