#include "analysis/discover/law.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "analysis/diagnose/bench_parts.h"
#include "analysis/diagnose/told_from_nothing.h"
#include "analysis/discover/curves.h"
#include "analysis/numerics/parallel.h"
#include "hal/error.h"
#include "model/catalogue.h"
#include "model/machine/memory.h"

namespace emtb {
namespace {

/// Of the formulas that explain most, so many.
auto best(std::size_t most) {
  return [most](std::vector<EquationError> formulas) {
    if (formulas.size() > most) formulas.resize(most);
    return formulas;
  };
}

/// Of the curves that explain as much as the best, those of the fewest values.
std::vector<EquationError> shortest_curves(std::vector<EquationError> curves) {
  constexpr double as_much = 0.03;
  constexpr std::size_t most = 4;
  if (curves.empty()) return curves;
  const double best = curves.front().share;
  std::erase_if(curves, [&](const EquationError& e) { return e.share < best - as_much; });
  std::ranges::stable_sort(curves, {}, [](const EquationError& e) { return e.law.parameters.size(); });
  if (curves.size() > most) curves.resize(most);
  return curves;
}

/// The curve of each quantity that explains most.
std::vector<EquationError> curve_of_each(std::vector<EquationError> curves) {
  std::vector<EquationError> best;
  for (EquationError& e : curves) {
    const auto same = [&](const EquationError& other) { return other.law.of.front() == e.law.of.front(); };
    if (std::ranges::none_of(best, same)) best.push_back(std::move(e));
  }
  return best;
}

constexpr double ceiling = 0.2;    ///< of what is left: of less there is no law
constexpr double something = 0.1;  ///< of what is left, that one of several explains

/// Where something is left that a smooth function explains.
struct Places {
  bool torque = false, voltage = false;
};

Places places_of(const WhatIsLeft& left, const Shares& torque, const Shares& voltage) {
  constexpr double far_less = 0.25;  // of what drives the motor
  const double torque_share = left.torque_scale > 0 ? torque.rms / left.torque_scale : 0;
  const double voltage_share = left.voltage_seen && left.voltage_scale > 0 ? voltage.rms / left.voltage_scale : 0;
  return {torque.ceiling >= ceiling && torque_share > far_less * voltage_share,
          voltage.ceiling >= ceiling && voltage_share > far_less * torque_share};
}

/// The formula with the values that a fit gave it.
FormulaText with_values(FormulaText text, const std::vector<Parameter>& fitted) {
  for (FormulaText::Parameter& p : text.parameters) {
    const auto at = std::ranges::find(fitted, p.symbol, &Parameter::symbol);
    if (at != fitted.end()) p.value = at->value;
  }
  return text;
}

/// What a model does to all readings beside another one, in floors.
std::vector<double> change(const Dataset& data, const Model& with, const Model& without) {
  std::vector<double> d;
  const auto a = residuals(data.train, with, with.values(), {}),
             b = residuals(data.train, without, without.values(), {});
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (Eigen::Index k = 0; k < a[i].value.size(); ++k) d.push_back(a[i].value[k] - b[i].value[k]);
  }
  return d;
}

double cosine(const std::vector<double>& a, const std::vector<double>& b) {
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) {
    ab += a[i] * b[i];
    aa += a[i] * a[i];
    bb += b[i] * b[i];
  }
  return aa > 0 && bb > 0 && std::isfinite(bb) ? ab / std::sqrt(aa * bb) : 0;
}

/// The effect of the library that the bench may have, whose absence the law makes up for most alike, and how alike.
void compare_with_library(Law& law, const Dataset& data, const Trial& base, FittedTrials& trials) {
  constexpr double alike = 0.8;
  Model without = law.model;
  without.terms.pop_back();
  const std::vector<double> own = change(data, law.model, without);
  const std::vector<Score> scores = trials.scores(base);
  const std::vector<Withheld> withheld = withheld_effects(without, data.train);
  std::vector<double> likeness(scores.size(), 0.0);
  parallel_for(scores.size(), [&](std::size_t i) {
    const Score& s = scores[i];
    if (s.effect >= effect_catalogue().size() || s.starts.empty()) return;
    if (std::ranges::find(withheld, s.effect, &Withheld::effect) != withheld.end()) return;
    try {
      Model with = without;
      with.include(s.effect);
      std::vector<Parameter>& p = with.parameters_of(s.effect);
      for (std::size_t k = 0; k < p.size() && k < s.expected().size(); ++k) {
        if (!std::isfinite(s.expected()[k])) return;
        p[k].value = std::clamp(s.expected()[k], p[k].min, p[k].max);
      }
      likeness[i] = std::abs(cosine(own, change(data, with, without)));
    } catch (const ModelError&) {
      likeness[i] = 0;  // a load heavier than the rotor: nothing is alike
    }
  });
  const auto best = std::ranges::max_element(likeness);
  if (best == likeness.end() || !(*best > alike)) return;
  law.likeness = *best;
  law.resembles = std::string(effect_catalogue()[scores[static_cast<std::size_t>(best - likeness.begin())].effect].id);
}

double& quantity(TermInput& at, const std::string& name) {
  return name == "omega"   ? at.omega
         : name == "i_a"   ? at.i_a
         : name == "t"     ? at.t
         : name == "u_ref" ? at.u_ref
                           : at.theta;
}

/// What a formula remembers where a state lasts, and how that changes with its parameters.
double lasting(const AddedTerm& term, TermInput at, std::span<const double> p, std::vector<double>& by) {
  const auto rate = rate_over_memory(*term.rate, at, p, by);
  const double z = lasting_memory<double>(rate);
  double slope = 0;
  rate(z, slope);
  for (double& one : by) one = slope < 0 ? -one / slope : 0;
  return z;
}

/// A formula over places of one quantity, the others as they are, which last. @param error by the standard errors; may
/// be null
std::vector<double> curve(const AddedTerm& term, TermInput at, const std::string& over, std::span<const double> places,
                          std::vector<double>* error) {
  std::vector<double> p, by(term.parameters.size()), memory_by(by.size()), values;
  for (const Parameter& one : term.parameters) p.push_back(one.value);
  for (const double place : places) {
    quantity(at, over) = place;
    if (term.rate) at.memory = lasting(term, at, p, memory_by);
    TermInput by_input;
    values.push_back(term.term->evaluate(at, p, by_input, by));
    for (std::size_t k = 0; k < by.size(); ++k) by[k] += by_input.memory * memory_by[k];
    if (error == nullptr) continue;
    double variance = 0;
    for (std::size_t k = 0; k < by.size(); ++k) {
      const Parameter& one = term.parameters[k];
      if (!one.fixed && one.std_error) variance += std::pow(by[k] * *one.std_error, 2);
    }
    error->push_back(std::sqrt(variance));
  }
  return values;
}

/// What is between two curves beside a straight line through zero, which is a base parameter's.
std::vector<double> apart(std::span<const double> x, std::span<const double> a, std::span<const double> b) {
  double xy = 0, xx = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    xy += x[k] * (a[k] - b[k]);
    xx += x[k] * x[k];
  }
  std::vector<double> off;
  for (std::size_t k = 0; k < x.size(); ++k) off.push_back(std::abs(a[k] - b[k] - (xx > 0 ? xy / xx * x[k] : 0)));
  return off;
}

/// The peaks of a curve, largest first.
std::vector<double> places_of_peaks(std::span<const double> x, const std::vector<double>& y) {
  constexpr std::size_t most = 3;
  std::vector<std::size_t> peaks;
  for (std::size_t k = 0; k < y.size(); ++k) {
    const bool before = k == 0 || y[k] > y[k - 1], after = k + 1 == y.size() || y[k] >= y[k + 1];
    if (before && after && y[k] > 0) peaks.push_back(k);
  }
  std::ranges::stable_sort(peaks, std::greater{}, [&](std::size_t k) { return y[k]; });
  if (peaks.size() > most) peaks.resize(most);
  std::vector<double> places;
  for (const std::size_t k : peaks) places.push_back(x[k]);
  return places;
}

/// The law over the range of its first quantity, the others at their rms.
void draw(Law& law, const Samples& s, const ReadFormula& read) {
  constexpr std::size_t points = 41;
  const std::string& over = law.text.of.front();
  const std::vector<double>& x = states_over(s, over);
  auto [low, high] = std::ranges::minmax(x);
  if (over == "theta") {
    low = 0;
    high = 6.283185307179586;
  }
  const auto size = [](const std::vector<double>& v) {
    double sum = 0;
    for (const double one : v) sum += one * one;
    return v.empty() ? 0 : std::sqrt(sum / static_cast<double>(v.size()));
  };
  for (std::size_t k = 0; k < points; ++k) law.at.push_back(low + (high - low) * static_cast<double>(k) / (points - 1));
  const TermInput at{size(s.omega), size(s.i_a), 0, size(s.u_ref), size(s.t)};
  law.value = curve(law.model.terms.back(), at, over, law.at, &law.value_error);
  std::vector<double> unsure = law.value_error;
  for (const FormulaText& other : law.tied_with) {
    if (other.of.front() != over || other.place != law.text.place) continue;
    const std::vector<double> off = apart(law.at, curve(read(other), at, over, law.at, nullptr), law.value);
    for (std::size_t k = 0; k < points; ++k) unsure[k] = std::max(unsure[k], off[k]);
  }
  law.most_uncertain_at = places_of_peaks(law.at, unsure);
}

/// A law in simulation, from where equation error puts it, from less of it, and from the base parameters as given:
/// those of a model that lacked it may have bent. A curve needs nothing to start from. The fit that leaves least
/// counts.
std::optional<Trial> fitted_law(FittedTrials& trials, const Trial& base, const Model& offering, std::size_t effect,
                                const FormulaText& text) {
  constexpr double less = 0.3;
  std::optional<Trial> best;
  const auto from = [&](double size, bool base_as_given) {
    Model start = base.model();
    for (std::size_t i = 0; base_as_given && i < start.base.size(); ++i) {
      if (!start.base[i].fixed) start.base[i].value = offering.base[i].value;
    }
    start.offered = offering.offered;
    start.include(effect);
    for (Parameter& p : start.terms.back().parameters) {
      const auto known = std::ranges::find(text.parameters, p.symbol, &FormulaText::Parameter::symbol);
      if (!p.fixed) p.value = known->amplitude ? size * known->value : known->value;
    }
    std::optional<Trial> trial = trials.fit(start, nullptr);
    if (trial && (!best || trial->squares < best->squares)) best = std::move(trial);
  };
  from(1, false);
  if (text.is_curve) {
    from(0, true);
  } else {
    from(less, false);
    from(1, true);
  }
  return best;
}

/// Is some amplitude beyond three standard errors, with all that full ones count?
bool told_for_sure(const std::vector<Parameter>& fitted, const FormulaText& text) {
  constexpr double errors = 3;
  return std::ranges::any_of(fitted, [&](const Parameter& p) {
    const auto known = std::ranges::find(text.parameters, p.symbol, &FormulaText::Parameter::symbol);
    return known != text.parameters.end() && known->amplitude && p.std_error &&
           std::abs(p.value) > errors * *p.std_error;
  });
}

struct Fitted {
  std::size_t text = 0, effect = 0;
  Trial trial;
};

/// What a search for a law stands on.
struct Ground {
  const Dataset& data;
  const Trial& base;
  const Model& given;
  const Criterion& criterion;
  std::span<const Record> confirm;
  const WhatIsLeft& left;
  const ReadFormula& read;
};

/// The law that a fitted formula is, unless it is not determined, not told for sure or not confirmed.
std::optional<Law> confirmed(const Ground& g, const Fitted& best, const FormulaText& text, FittedTrials& trials) {
  if (!trials.determined(best.trial.model(), best.effect)) return {};
  Law law;
  Fit told = with_standard_errors(g.data.train, best.trial.model());
  law.model = std::move(told.model);
  law.at_bound = std::move(told.at_bound);
  law.parameters = law.model.terms.back().parameters;
  if (!told_for_sure(law.parameters, text)) return {};
  law.text = with_values(text, law.parameters);
  law.train_before = g.base.train;
  law.train_after = best.trial.train;
  law.held_out_before = g.base.held_out.error();
  law.held_out_after = best.trial.held_out.error();
  if (g.base.held_out.quality && best.trial.held_out.quality) {
    law.nats = gain(*g.base.held_out.quality, *best.trial.held_out.quality);
  }
  if (g.confirm.empty()) return law;
  law.confirm_before = error_on(g.confirm, g.base.model());
  law.confirm_after = error_on(g.confirm, law.model);
  if (!(*law.confirm_after < *law.confirm_before)) return {};
  law.held_out_before = error_of(squares_on_held_out(g.data, g.confirm, g.base.model()));
  law.held_out_after = error_of(squares_on_held_out(g.data, g.confirm, law.model));
  return law;
}

/// What is worth a fit in simulation, by equation error: of the torque and of the voltage.
/// @param propose sentences or curves @param least of what is left that they explain @param choose of those, best first
template <class Propose, class Choose>
std::vector<FormulaText> worth_a_fit(const Ground& g, const Places& places, const Propose& propose, double least,
                                     const Choose& choose) {
  std::vector<FormulaText> texts;
  for (const bool of_voltage : {false, true}) {
    if (!(of_voltage ? places.voltage : places.torque)) continue;
    const Samples s = samples_of(g.left, of_voltage);
    const auto laws = propose(s, g.left.torque_scale, g.left.voltage_scale, of_voltage);
    auto tried = by_equation_error(s, laws, g.read, g.base.model().values()[base::K_m]);
    std::erase_if(tried, [least](const EquationError& e) { return e.share < least; });
    for (EquationError& e : choose(std::move(tried))) texts.push_back(std::move(e.law));
  }
  return texts;
}

/// A law with the trial that found it.
struct Found {
  Law law;
  Trial trial;
};

/// Is it one curve, told by more values and by fewer?
bool same_curve(const FormulaText& a, const FormulaText& b) {
  return a.is_curve && b.is_curve && a.place == b.place && a.of == b.of && a.rate.empty() == b.rate.empty();
}

/// The best of some formulas that is a law, with those that do as well.
std::optional<Found> best_of(const Ground& g, const std::vector<FormulaText>& texts) {
  if (texts.empty()) return {};
  Model offering = g.given;
  const std::size_t first = offering.known_effects();
  for (const FormulaText& text : texts) offering.offered.push_back(g.read(text));
  const ScoreOptions score;
  FittedTrials trials(g.data, offering, g.criterion, score, texts.size());
  std::vector<Fitted> good;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    std::optional<Trial> trial = fitted_law(trials, g.base, offering, first + i, texts[i]);
    if (!trial || !g.criterion.material(g.base.held_out, trial->held_out)) continue;
    good.push_back({i, first + i, std::move(*trial)});
  }
  std::ranges::stable_sort(good, {}, [](const Fitted& f) { return f.trial.held_out.error(); });
  for (const Fitted& best : good) {
    std::optional<Law> law = confirmed(g, best, texts[best.text], trials);
    if (!law) continue;
    for (const Fitted& other : good) {
      if (other.text == best.text || same_curve(texts[other.text], texts[best.text])) continue;
      if (!g.criterion.tied(best.trial.held_out, other.trial.held_out)) continue;
      law->tied_with.push_back(with_values(texts[other.text], other.trial.model().terms.back().parameters));
    }
    draw(*law, samples_of(g.left, law->text.place == TermPlace::voltage), g.read);
    compare_with_library(*law, g.data, g.base, trials);
    return Found{std::move(*law), best.trial};
  }
  return {};
}

/// Does one law do what the other does not?
bool says_more(const Criterion& criterion, const Found& one, const Found& other) {
  constexpr double nats = 3;  // as of a name
  const Loss &with = one.trial.held_out, &without = other.trial.held_out;
  if (!criterion.material(without, with)) return false;
  if (other.law.confirm_after && !(*one.law.confirm_after < *other.law.confirm_after)) return false;
  return !with.quality || !without.quality || gain(*without.quality, *with.quality) > nats;
}

/// Notes how much the best explains.
template <class Choose>
auto noting(double& explained, const Choose& choose) {
  return [&explained, choose](std::vector<EquationError> tried) {
    if (!tried.empty()) explained = std::max(explained, tried.front().share);
    return choose(std::move(tried));
  };
}

/// Laws of one kind after the other, from the shortest: one takes the place of those before where it does what they do
/// not. What is at the floor asks for no more. One that remembers has to explain more of what is left than those that
/// do not.
class SearchForALaw {
 public:
  SearchForALaw(const Ground& ground, const Shares& torque, const Shares& voltage)
      : ground_(ground), places_(places_of(ground.left, torque, voltage)) {}

  std::optional<Found> run() {
    double explained = something, by_curves = something;
    offer([&] { return of(places_, sentences, something, noting(explained, best(8))); });
    offer([&] { return of_what_remembers(remembering_sentences, explained, best(4)); });
    offer([&] { return of(places_, curves, something, noting(by_curves, shortest_curves)); });
    // The base parameters of a model that lacks much may have bent until what is left is no function of the states any
    // more: then only a fit of both together tells.
    if (!best_ && ground_.criterion.worth_trying_all(ground_.base.held_out)) {
      offer([&] { return of({.torque = true}, curves, -infinity, curve_of_each); });
    }
    // A curve that lags bends to any path that is run a second time: another run has to confirm it.
    if (ground_.confirm.empty()) return std::move(best_);
    offer([&] { return of_what_remembers(remembering_curves, std::max(explained, by_curves), shortest_curves); });
    return std::move(best_);
  }

 private:
  bool any() const { return places_.torque || places_.voltage; }

  template <class Propose, class Choose>
  std::optional<Found> of(const Places& places, const Propose& propose, double least, const Choose& choose) const {
    return best_of(ground_, worth_a_fit(ground_, places, propose, least, choose));
  }

  /// Where no smooth function of the states explains much, a memory of them may.
  template <class Propose, class Choose>
  std::optional<Found> of_what_remembers(const Propose& propose, double explained, const Choose& choose) const {
    return any() ? of(places_, propose, explained, choose) : of({.torque = true}, propose, ceiling, choose);
  }

  template <class Search>
  void offer(const Search& search) {
    constexpr double at_the_floor = 1.05;
    if (left_ < at_the_floor) return;
    std::optional<Found> found = search();
    if (!found || (best_ && !says_more(ground_.criterion, *found, *best_))) return;
    if (best_ && found->law.text.is_curve) {
      Law& before = best_->law;
      found->law.nearest = before.text.is_curve ? before.nearest : before.text;
      found->law.nearest_held_out = before.text.is_curve ? before.nearest_held_out : before.held_out_after;
    }
    left_ = found->law.held_out_after;
    best_ = std::move(found);
  }

  const Ground& ground_;
  Places places_;
  std::optional<Found> best_;
  double left_ = infinity;  ///< by the best, held out [noise floors]
};

/// The same law with what it holds set free, as far as that has bounds, where that says more.
std::optional<Found> set_free(const Ground& ground, const Found& found) {
  FormulaText free = found.law.text;
  bool any = false;
  for (FormulaText::Parameter& p : free.parameters) {
    any = any || (p.fixed && p.min < p.max);
    p.fixed = p.fixed && !(p.min < p.max);
  }
  if (!any) return {};
  std::optional<Found> freed = best_of(ground, {free});
  if (!freed || !says_more(ground.criterion, *freed, found)) return {};
  freed->law.nearest = found.law.nearest;
  freed->law.nearest_held_out = found.law.nearest_held_out;
  return freed;
}

}  // namespace

std::map<Signal, double> squares_on_held_out(const Dataset& data, std::span<const Record> confirm, const Model& model) {
  std::vector<Residuals> left = residuals(data.held_out, model, model.values(), {});
  std::ranges::move(residuals(confirm, model, model.values(), {}), std::back_inserter(left));
  return mean_squares(left);
}

std::optional<Law> find_law(const Dataset& data, const Trial& base, const Model& given, const Criterion& criterion,
                            std::span<const Record> confirm, const WhatIsLeft& left, const Shares& torque,
                            const Shares& voltage, const ReadFormula& read) {
  const Ground ground{data, base, given, criterion, confirm, left, read};
  std::optional<Found> found = SearchForALaw(ground, torque, voltage).run();
  if (!found) return {};
  if (std::optional<Found> freed = set_free(ground, *found)) return std::move(freed->law);
  return std::move(found->law);
}

}  // namespace emtb
