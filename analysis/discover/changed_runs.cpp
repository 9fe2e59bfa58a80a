#include "analysis/discover/changed_runs.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "analysis/diagnose/likelihood.h"
#include "analysis/diagnose/loss.h"
#include "analysis/discover/between_runs.h"
#include "analysis/discover/library_rival.h"
#include "analysis/fit/calibrate.h"
#include "analysis/numerics/linear_algebra.h"
#include "analysis/numerics/parallel.h"
#include "hal/error.h"

namespace emtb {
namespace {

constexpr double least_change = 0.03;      // of the value
constexpr double share = 0.1;              // of what is above the floor
constexpr double of_readings = 0.02;       // of the mean square of all that is read
constexpr std::size_t fewest = 4;          // runs
constexpr std::size_t enough_others = 16;  // tell the scatter between runs

/// Which runs have how much of a change.
struct Pattern {
  ChangeOf how{};
  std::size_t first = 0;
  std::vector<double> weight;  ///< of each run: 0 none of it, 1 all
};

std::vector<Pattern> patterns(std::size_t runs) {
  std::vector<Pattern> all;
  for (std::size_t r = 0; r < runs; ++r) {
    Pattern one{ChangeOf::one_run, r, std::vector<double>(runs, 0.0)};
    one.weight[r] = 1;
    all.push_back(std::move(one));
  }
  for (std::size_t r = 2; r + 2 <= runs; ++r) {
    Pattern on{ChangeOf::from_here_on, r, std::vector<double>(runs, 0.0)};
    std::fill(on.weight.begin() + static_cast<std::ptrdiff_t>(r), on.weight.end(), 1.0);
    all.push_back(std::move(on));
  }
  Pattern drift{ChangeOf::drift, 0, {}};
  for (std::size_t r = 0; r < runs; ++r) drift.weight.push_back(static_cast<double>(r) / static_cast<double>(runs - 1));
  all.push_back(std::move(drift));
  return all;
}

/// The normal equations of one run.
struct OfRun {
  Eigen::MatrixXd sts;
  Eigen::VectorXd str;
};

std::vector<OfRun> equations_of(std::span<const Record> records, const Model& fitted) {
  const FreeParameters free(fitted);
  const auto n = static_cast<Eigen::Index>(free.size());
  std::vector<OfRun> all(records.size(), {Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)});
  for (const Residuals& r : residuals(records, fitted, fitted.values(), moved_by(free))) {
    if (!r.informed()) continue;
    all[r.record].sts += gram(r.sensitivity);
    all[r.record].str += transposed_product(r.sensitivity, r.value);
  }
  return all;
}

/// What a change of one parameter promises.
struct Promise {
  std::size_t pattern = 0, free = 0;
  double drop = 0;  ///< of the sum of squares
};

/// @param way by which the free parameters change together
double promised(std::span<const OfRun> runs, const Pattern& pattern, const Eigen::VectorXd& way) {
  const Eigen::Index n = runs.front().str.size();
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd along = Eigen::VectorXd::Zero(n), cross = Eigen::VectorXd::Zero(n);
  double own = 0, own_along = 0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const double w = pattern.weight[r];
    all += runs[r].sts;
    along += runs[r].str;
    const Eigen::VectorXd seen = product(runs[r].sts, way);
    cross += w * seen;
    own += w * w * way.dot(seen);
    own_along += w * way.dot(runs[r].str);
  }
  constexpr double imitated = 1e-6;
  const Eigen::VectorXd by_base = solve_normal(all, cross);
  const double alone = own - cross.dot(by_base), gradient = own_along - along.dot(by_base);
  return alone > imitated * own ? gradient * gradient / alone : 0;
}

/// One parameter of some runs, the others as they are.
struct Alone {
  double value = 0, std_error = std::numeric_limits<double>::infinity();
  double squares_before = 0, readings = 0;
  std::vector<Residuals> left;
};

std::size_t place_of(const Model& model, const std::string& parameter) {
  const auto names = model.names();
  return static_cast<std::size_t>(std::ranges::find(names, parameter) - names.begin());
}

/// All free parameters fitted to some runs, from where they are.
Model fit_of(std::span<const Record> runs, const Model& model) {
  return calibrate(runs, model, {.extra_starts = 0, .max_iterations = 25, .tolerance = 1e-6, .with_covariance = false})
      .model;
}

/// The armature's flux makes both constants: where K_b is another one, so is K_m, by as much.
std::optional<std::size_t> follower_of(const Model& model, std::size_t place) {
  const bool flux = place == base::K_b && !model.at(base::K_m).fixed && !model.tie.contains("K_m");
  return flux ? std::optional<std::size_t>(base::K_m) : std::nullopt;
}

void change(Model& model, std::size_t place, std::optional<std::size_t> follower, double value) {
  if (follower) {
    Parameter& p = model.at(*follower);
    p.value = std::clamp(p.value * value / model.at(place).value, p.min, p.max);
  }
  model.at(place).value = value;
}

Alone one_parameter(std::span<const Record> runs, Model model, std::size_t place) {
  const auto follower = follower_of(model, place);
  for (std::size_t i = 0; i < model.names().size(); ++i) {
    if (i != place) model.at(i).fixed = true;
  }
  Alone found;
  found.value = model.at(place).value;
  found.left = residuals(runs, model, model.values(), {});
  found.squares_before = sum_of_squares(found.left);
  for (const Residuals& r : found.left) found.readings += static_cast<double>(r.value.size());
  const auto fit = [&] {
    const Calibration c = calibrate(
        runs, model,
        {.extra_starts = 0, .max_iterations = 12, .tolerance = 1e-5, .with_covariance = true, .quick_errors = true});
    found.value = c.model.at(place).value;
    if (c.model.at(place).std_error) found.std_error = *c.model.at(place).std_error;
    change(model, place, follower, found.value);
  };
  try {
    constexpr int turns = 3;  // each with what follows where the one before put it: they agree within their errors then
    for (int turn = 0; turn < (follower ? turns : 1); ++turn) fit();
    found.left = residuals(runs, model, model.values(), {});
  } catch (const ModelError&) {
    return found;
  }
  return found;
}

/// What runs say of a parameter, each by itself.
struct Spread {
  std::vector<double> value, error;
};

/// @param most so many of them, evenly chosen
Spread each_alone(std::span<const Record> runs, const Model& model, std::size_t place, std::size_t most) {
  const std::size_t n = std::min(most, runs.size());
  Spread spread{std::vector<double>(n), std::vector<double>(n)};
  each_on_a_core(n, [&](std::size_t i) {
    const Alone one = one_parameter(runs.subspan(i * runs.size() / n, 1), model, place);
    spread.value[i] = one.value;
    spread.error[i] = one.std_error;
  });
  return spread;
}

/// All runs with residuals that come from fits to some of them each.
Quality quality_of(std::span<const Record> records, std::span<const Residuals> left, std::size_t free) {
  return {squares_of(records, left), {}, memory_of(spectra_of(records, left)), free};
}

class Search {
 public:
  Search(std::span<const Record> records, const Model& fitted)
      : records_(records), fitted_(fitted), free_(fitted), patterns_(patterns(records.size())) {
    const std::vector<Residuals> left = residuals(records, fitted, fitted.values(), {});
    quality_ = quality_of(records, left, free_.size());
    readings_.resize(records.size(), 0.0);
    for (const Residuals& r : left) readings_[r.record] += static_cast<double>(r.value.size());
  }

  const Quality& quality() const { return quality_; }

  /// The best change of all.
  std::optional<Changed> best() const {
    std::optional<Changed> found;
    OthersOf others;
    for (const Promise& p : promises()) {
      std::optional<Changed> one = judged(patterns_[p.pattern], free_.places()[p.free], others);
      if (one && (!found || one->nats > found->nats)) found = std::move(one);
    }
    return found;
  }

  /// Whether that change holds here. @param change found beside another model of the same runs
  std::optional<Changed> again(const Changed& change) const {
    const auto pattern = std::ranges::find_if(
        patterns_, [&](const Pattern& p) { return p.how == change.how && records_[p.first].name == change.run; });
    OthersOf others;
    return judged(*pattern, place_of(fitted_, change.parameter), others);
  }

 private:
  /// What is worth a fit: the best few patterns, of each the parameters that come near its best.
  std::vector<Promise> promises() const {
    constexpr std::size_t most = 5;
    constexpr double near = 0.3, least = 9, in_part = 0.3;  // nine: three standard errors of white noise
    const std::vector<OfRun> runs = equations_of(records_, fitted_);
    std::vector<Promise> best, all;
    for (std::size_t p = 0; p < patterns_.size(); ++p) {
      double readings = 0;
      for (std::size_t r = 0; r < runs.size(); ++r) readings += patterns_[p].weight[r] * readings_[r];
      const std::size_t begin = all.size();
      Promise top{p, 0, 0};
      for (std::size_t j = 0; j < free_.size(); ++j) {
        const double drop = promised(runs, patterns_[p], way_of(j));
        all.push_back({p, j, drop});
        if (drop > top.drop) top = all.back();
      }
      if (top.drop > std::max(least, in_part * of_readings * readings)) {
        best.push_back(top);
      } else {
        all.resize(begin);
      }
    }
    std::ranges::stable_sort(best, std::greater{}, &Promise::drop);
    if (best.size() > most) best.resize(most);
    std::erase_if(all, [&](const Promise& one) {
      const auto top = std::ranges::find(best, one.pattern, &Promise::pattern);
      return top == best.end() || one.drop < near * top->drop;
    });
    return all;
  }

  Eigen::VectorXd way_of(std::size_t free) const {
    const std::size_t place = free_.places()[free];
    Eigen::VectorXd way = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(free_.size()));
    way[static_cast<Eigen::Index>(free)] = 1;
    if (const auto follower = follower_of(fitted_, place)) {
      const auto at = std::ranges::find(free_.places(), *follower) - free_.places().begin();
      way[at] = fitted_.at(*follower).value / fitted_.at(place).value;
    }
    return way;
  }

  /// The fit of the runs that a pattern leaves as they were, kept from one parameter to the next.
  struct OthersOf {
    const Pattern* pattern = nullptr;
    Model model;
  };

  std::optional<Changed> judged(const Pattern& pattern, std::size_t place, OthersOf& others) const {
    try {
      return pattern.how == ChangeOf::drift ? judged_drift(pattern, place) : judged_step(pattern, place, others);
    } catch (const ModelError&) {
      return std::nullopt;  // some runs cannot be simulated without the others: nothing is told
    }
  }

  Changed named(const Pattern& pattern, std::size_t place) const {
    Changed c;
    c.how = pattern.how;
    c.run = records_[pattern.first].name;
    c.parameter = fitted_.names()[place];
    c.unit = fitted_.at(place).unit;
    for (std::size_t r = 0; r < records_.size(); ++r) {
      if (pattern.how == ChangeOf::drift || pattern.weight[r] > 0) c.runs.push_back(records_[r].name);
    }
    return c;
  }

  std::optional<Changed> judged_step(const Pattern& pattern, std::size_t place, OthersOf& kept) const {
    std::vector<Record> as_they_were, with_it;
    for (std::size_t r = 0; r < records_.size(); ++r) {
      (pattern.weight[r] > 0 ? with_it : as_they_were).push_back(records_[r]);
    }
    if (kept.pattern != &pattern) kept = {&pattern, fit_of(as_they_were, fitted_)};
    const Model& others = kept.model;
    const Alone own = one_parameter(with_it, others, place);
    Changed c = named(pattern, place);
    c.from = others.at(place).value;
    c.to = own.value;
    c.others = others;
    const double off = c.to - c.from;
    if (std::abs(off) < least_change * std::abs(c.from) || !takes_its_share(own)) return std::nullopt;
    if (!beyond(off, own.std_error, {})) return std::nullopt;  // before the others are asked, which takes longer
    const Spread spread = each_alone(as_they_were, others, place, enough_others);
    std::vector<double> apart;
    for (const double value : spread.value) apart.push_back(value - c.from);
    const Between between = between_runs(apart, spread.error, 1);
    if (!beyond(off, own.std_error, between)) return std::nullopt;
    c.std_error = std::sqrt(own.std_error * own.std_error + between.variance);
    std::vector<Residuals> left = residuals(as_they_were, others, others.values(), {});
    std::vector<Record> all = as_they_were;
    add(left, all, own.left, with_it);
    return if_likelier(std::move(c), all, left);
  }

  /// A line through what each run says by itself.
  std::optional<Changed> judged_drift(const Pattern& pattern, std::size_t place) const {
    const Spread spread = each_alone(records_, fitted_, place, records_.size());
    const DriftLine line = line_through(pattern.weight, spread.value, spread.error);
    if (!line.clear() || std::abs(line.slope) < least_change * std::abs(line.middle)) return std::nullopt;
    Changed c = named(pattern, place);
    c.from = line.at(0);
    c.to = line.at(1);
    c.others = fitted_;
    c.std_error = line.slope_error;
    std::vector<Residuals> left;
    std::vector<Record> all;
    for (std::size_t r = 0; r < records_.size(); ++r) {
      Model here = fitted_;
      const Parameter& p = here.at(place);
      change_to(here, c.parameter, std::clamp(line.at(pattern.weight[r]), p.min, p.max));
      const std::span<const Record> one = records_.subspan(r, 1);
      add(left, all, residuals(one, here, here.values(), {}), one);
    }
    return if_likelier(std::move(c), all, left);
  }

  static bool takes_its_share(const Alone& own) {
    const double excess = std::max(0.0, own.squares_before - own.readings);
    const double gone = own.squares_before - sum_of_squares(own.left);
    return gone > share * excess && gone > of_readings * own.readings;
  }

  static void add(std::vector<Residuals>& left, std::vector<Record>& all, std::span<const Residuals> more,
                  std::span<const Record> of) {
    const std::size_t before = all.size();
    for (Residuals r : more) {
      r.record += before;
      left.push_back(std::move(r));
    }
    all.insert(all.end(), of.begin(), of.end());
  }

  std::optional<Changed> if_likelier(Changed c, std::span<const Record> all, std::span<const Residuals> left) const {
    c.nats = gain(quality_, quality_of(all, left, free_.size() + 1));
    if (c.nats < Materiality{}.nats) return std::nullopt;
    return c;
  }

  std::span<const Record> records_;
  const Model& fitted_;
  FreeParameters free_;
  std::vector<Pattern> patterns_;
  Quality quality_;
  std::vector<double> readings_;
};

/// The best change that stands beside the library.
std::optional<Changed> best_change(std::span<const Record> records, const Model& fitted) {
  constexpr double clear = 3;  // nats
  const Search search(records, fitted);
  std::optional<Changed> found = search.best();
  if (!found) return found;
  const std::optional<LibraryRival> rival = best_of_library(records, fitted, search.quality());
  if (!rival) return found;
  if (const auto beside = Search(records, rival->model).again(*found)) return beside;
  if (rival->nats > found->nats + clear) return std::nullopt;
  if (rival->nats > found->nats - clear) found->tied_with.push_back(rival->id);
  return found;
}

}  // namespace

void change_to(Model& model, const std::string& parameter, double value) {
  const std::size_t place = place_of(model, parameter);
  change(model, place, follower_of(model, place), value);
}

std::vector<Changed> changed_runs(std::span<const Record> records, const Model& fitted) {
  std::vector<Record> rest(records.begin(), records.end());
  std::vector<Changed> changed;
  Model model = fitted;
  while (rest.size() >= fewest && FreeParameters(model).size() > 0) {
    std::optional<Changed> one = best_change(rest, model);
    if (!one) break;
    changed.push_back(std::move(*one));
    if (changed.back().how != ChangeOf::one_run) break;
    std::erase_if(rest, [&](const Record& r) { return r.name == changed.back().run; });
    if (rest.size() < fewest) break;
    model = fit_of(rest, model);
  }
  return changed;
}

}  // namespace emtb
