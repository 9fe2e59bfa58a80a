#include "analysis/diagnose/missing_curve.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "analysis/fit/normal_equations.h"
#include "analysis/fit/residuals.h"
#include "analysis/numerics/linear_algebra.h"
#include "analysis/numerics/parallel.h"
#include "model/simulation.h"

namespace emtb {
namespace {

constexpr std::size_t knots_a_side = 16;
constexpr double fewest_seconds = 0.05;  ///< near a knot: less tells nothing

/// A curve through knots, straight in between, level beyond the last of each side, and nothing at rest. The inner end
/// of a side is open: friction jumps there.
class CurveTerm final : public Term {
 public:
  CurveTerm(std::vector<double> knots, double TermInput::*against) : knots_(std::move(knots)), against_(against) {}

  double evaluate(const TermInput& x, std::span<const double> p, TermInput& by_input,
                  std::span<double> by_parameter) const override {
    by_input = {};
    std::ranges::fill(by_parameter, 0.0);
    const double at = x.*against_;
    const auto side = std::ranges::partition_point(knots_, [](double k) { return k < 0; }) - knots_.begin();
    const auto negative = static_cast<std::size_t>(side);
    const std::size_t first = at < 0 ? 0 : negative, last = at < 0 ? negative : knots_.size();
    if (first == last || std::abs(at) < standstill()) return 0;
    const auto above =
        static_cast<std::size_t>(std::lower_bound(knots_.begin() + static_cast<std::ptrdiff_t>(first),
                                                  knots_.begin() + static_cast<std::ptrdiff_t>(last), at) -
                                 knots_.begin());
    if (above == first || above == last) {
      const std::size_t end = above == first ? first : last - 1;
      by_parameter[end] = 1;
      return p[end];
    }
    const double width = knots_[above] - knots_[above - 1], share = (at - knots_[above - 1]) / width;
    by_parameter[above - 1] = 1 - share;
    by_parameter[above] = share;
    by_input.*against_ = (p[above] - p[above - 1]) / width;
    return (1 - share) * p[above - 1] + share * p[above];
  }

 private:
  /// A tenth of the innermost knot.
  double standstill() const {
    double least = 1e300;
    for (const double k : knots_) least = std::min(least, std::abs(k));
    return 0.1 * least;
  }

  std::vector<double> knots_;
  double TermInput::*against_;
};

/// How long the simulation stays near each value of a quantity.
struct Stay {
  std::vector<double> value, seconds;
};

Stay stay_of(std::span<const Record> records, const Model& model, bool current) {
  Stay stay;
  const std::vector<double> values = model.values();
  std::vector<std::vector<double>> signals(records.size());
  parallel_for(records, [&](std::size_t i) {
    Trajectory<double> y;
    simulate<double>(records[i].structure(model), values, records[i].excitation, y);
    signals[i] = std::move(current ? y.i_a : y.omega);
  });
  for (std::size_t i = 0; i < records.size(); ++i) {
    for (std::size_t k = 1; k < signals[i].size(); ++k) {
      stay.value.push_back(signals[i][k]);
      stay.seconds.push_back(records[i].excitation.t[k] - records[i].excitation.t[k - 1]);
    }
  }
  return stay;
}

/// Knots on both sides of zero, closer towards it, where the data stay long enough.
std::vector<double> knots_for(const Stay& stay) {
  double low = 0, high = 0;
  for (const double v : stay.value) {
    low = std::min(low, v);
    high = std::max(high, v);
  }
  std::vector<double> knots;
  const double most = std::max(high, -low);
  for (const double end : {low, high}) {
    if (std::abs(end) < 0.05 * most) continue;  // swings back a little when it stops
    for (std::size_t i = 0; i < knots_a_side; ++i) {
      const double share = static_cast<double>(i) / (knots_a_side - 1);
      knots.push_back(end * (0.02 + 0.98 * share));
    }
  }
  std::ranges::sort(knots);
  std::vector<double> seconds(knots.size(), 0.0);
  for (std::size_t k = 0; k < stay.value.size(); ++k) {
    // Of the two around it, the nearer on its own side of zero.
    const auto distance = [&](auto knot) {
      if (knot == knots.end()) return std::numeric_limits<double>::infinity();
      return std::abs(*knot - stay.value[k]) + (*knot * stay.value[k] < 0 ? most : 0);
    };
    const auto above = std::ranges::lower_bound(knots, stay.value[k]);
    const auto below = above == knots.begin() ? knots.end() : above - 1;
    const auto nearest = distance(below) < distance(above) ? below : above;
    if (nearest != knots.end()) seconds[static_cast<std::size_t>(nearest - knots.begin())] += stay.seconds[k];
  }
  std::vector<double> visited;
  for (std::size_t i = 0; i < knots.size(); ++i) {
    if (seconds[i] > fewest_seconds) visited.push_back(knots[i]);
  }
  return visited;
}

/// The linear least squares of residuals on sensitivities, a piece of one signal at a time.
struct ColumnFit {
  Eigen::VectorXd value, std_error;
};

/// @param change how far each column may go without a reason: what the data do not tell apart then goes to those that
/// may go far
ColumnFit fit_of_columns(std::span<const Record> records, const Model& model,
                         std::span<const std::vector<std::size_t>> columns, const Eigen::VectorXd& change) {
  const auto p = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd sts = Eigen::MatrixXd::Zero(p, p);
  Eigen::VectorXd str = Eigen::VectorXd::Zero(p);
  const std::vector<Residuals> all = residuals(records, model, model.values(), columns);
  // Each on a core, and added up in their order.
  std::vector<Block> parts(all.size());
  const auto length_of = [&](std::size_t i) { return all[i].value.size(); };
  parallel_for(
      all.size(),
      [&](std::size_t i) {
        const Residuals& r = all[i];
        if (r.informed()) parts[i] = {gram(r.sensitivity), transposed_product(r.sensitivity, r.value)};
      },
      length_of);
  for (const Block& part : parts) {
    if (part.str.size() == 0) continue;
    sts += part.sts;
    str += part.str;
  }
  const Eigen::MatrixXd information = sts;
  sts.diagonal() += change.cwiseAbs2().cwiseInverse();
  Eigen::VectorXd scale = sts.diagonal().cwiseSqrt();
  const double unseen = 1e-9 * scale.maxCoeff();
  for (double& x : scale) x = x > 0 ? 1 / x : 0;
  Eigen::MatrixXd scaled = scale.asDiagonal() * sts * scale.asDiagonal();
  const Eigen::MatrixXd inverse = scale.asDiagonal() * pseudo_inverse(scaled) * scale.asDiagonal();
  ColumnFit fit{inverse * str, Eigen::VectorXd::Constant(p, std::numeric_limits<double>::infinity())};
  const double length = shortest_piece(records);
  // The sandwich over blocks: what is left is coloured, all the more where something is missing.
  Eigen::MatrixXd meat = Eigen::MatrixXd::Zero(p, p);
  std::vector<std::vector<Eigen::VectorXd>> gradients(all.size());
  parallel_for(
      all.size(),
      [&](std::size_t i) {
        const Residuals& r = all[i];
        if (!r.informed()) return;
        const Eigen::VectorXd left = r.value - r.sensitivity * fit.value;
        const Record& record = records[r.record];
        for_each_piece(record, *record.find(r.signal), 0, r.value.size(), length,
                       [&](long, Eigen::Index begin, Eigen::Index rows) {
                         gradients[i].push_back(
                             transposed_product(r.sensitivity.middleRows(begin, rows), left.segment(begin, rows)));
                       });
      },
      length_of);
  for (const std::vector<Eigen::VectorXd>& of_one : gradients) {
    for (const Eigen::VectorXd& g : of_one) meat.noalias() += g * g.transpose();
  }
  const Eigen::MatrixXd sandwich = product(product(inverse, meat), inverse);
  const Eigen::MatrixXd white = product(product(inverse, information), inverse);
  for (Eigen::Index i = 0; i < p; ++i) {
    if (std::sqrt(information(i, i)) > unseen) fit.std_error[i] = std::sqrt(std::max(sandwich(i, i), white(i, i)));
  }
  return fit;
}

MissingCurve curve_of(std::span<const Record> records, const Model& fitted, bool voltage) {
  const std::vector<double> knots = knots_for(stay_of(records, fitted, voltage));
  MissingCurve curve{voltage ? "voltage" : "torque",
                     voltage ? "V" : "N m",
                     voltage ? "i_a" : "omega",
                     voltage ? "A" : "rad/s",
                     {},
                     {},
                     {}};
  if (knots.empty()) return curve;
  Model with = fitted;
  // A straight line through zero would be the parameter's own: it stays where it is, and so do the effects.
  with.base[voltage ? 0 : 3].fixed = true;
  for (IncludedEffect& e : with.effects) {
    for (Parameter& p : e.parameters) p.fixed = true;
  }
  for (AddedTerm& formula : with.terms) {
    for (Parameter& p : formula.parameters) p.fixed = true;
  }
  const FreeParameters free(with);
  std::vector<std::vector<std::size_t>> columns = moved_by(free);
  AddedTerm term;
  term.name = "missing";
  term.place = voltage ? TermPlace::voltage : TermPlace::torque;
  term.term = std::make_shared<CurveTerm>(knots, voltage ? &TermInput::i_a : &TermInput::omega);
  term.parameters.resize(knots.size());
  const std::size_t first = with.names().size(), others = columns.size();
  for (std::size_t i = 0; i < knots.size(); ++i) columns.push_back({first + i});
  with.terms.push_back(std::move(term));
  // A parameter that the data cannot tell from the curve stays where it is: a hundredth is far, without a reason.
  Eigen::VectorXd change = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(columns.size()), 1e6);
  for (std::size_t i = 0; i < others; ++i) {
    const Parameter& p = with.at(free.places()[i]);
    change[static_cast<Eigen::Index>(i)] = 0.01 * std::max(std::abs(p.value), 1e-3 * (p.max - p.min));
  }
  const ColumnFit fit = fit_of_columns(records, with, columns, change);
  for (std::size_t i = 0; i < knots.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(others + i);
    if (!std::isfinite(fit.std_error[column])) continue;  // nothing that was compared saw it
    curve.x.push_back(knots[i]);
    curve.value.push_back(fit.value[column]);
    curve.std_error.push_back(fit.std_error[column]);
  }
  return curve;
}

}  // namespace

std::vector<MissingCurve> missing_curves(std::span<const Record> records, const Model& fitted) {
  std::vector<MissingCurve> curves{curve_of(records, fitted, false)};
  const bool current = std::ranges::any_of(records, [](const Record& r) { return r.find(Signal::i_a) != nullptr; });
  if (current && fitted.input != Signal::i_a) curves.push_back(curve_of(records, fitted, true));
  std::erase_if(curves, [](const MissingCurve& c) { return c.x.empty(); });
  return curves;
}

}  // namespace emtb
