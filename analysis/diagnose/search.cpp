#include "analysis/diagnose/search.h"

#include <algorithm>

#include "analysis/diagnose/moves.h"
#include "model/catalogue.h"

namespace emtb {
namespace {

/// A sensor's error shows in its own reading. A gain elsewhere that this has no part in is a makeshift: a lag of the
/// gauge stands in for the noise of a load.
bool shows_itself(const EffectInfo& effect, const Loss& without, const Loss& with) {
  if (!effect.reads) return true;
  const auto differences = Loss::difference(without, with);
  const auto own = differences.find(*effect.reads);
  return own == differences.end() || own->second.gain > 0;
}

}  // namespace

Search::Search(Trials& trials, const Criterion& criterion, Trial first, Loss as_given, std::size_t longest_list,
               Progress progress)
    : Search(trials, criterion, Finding{std::move(first), {}, {}, {}, {}, {}, {}, {}}, std::move(as_given),
             std::move(progress)) {
  longest_list_ = longest_list;
  found_.steps.push_back({"fitted", {}, found_.current.train, found_.current.held_out_error()});
}

Search::Search(Trials& trials, const Criterion& criterion, Finding found, Loss as_given, Progress progress)
    : trials_(trials),
      criterion_(criterion),
      as_given_(std::move(as_given)),
      progress_(std::move(progress)),
      found_(std::move(found)),
      rounds_(trials, criterion) {}

Finding Search::without_superfluous() {
  if (auto fitted = trials_.fit_to_the_end(found_.current.model())) found_.current = std::move(*fitted);
  prune();
  if (rivals_are_stale_) renew_rivals();
  return std::move(found_);
}

Finding Search::with_rivals_renewed() {
  renew_rivals();
  return std::move(found_);
}

Finding Search::held_against_others() {
  if (auto fitted = trials_.fit_to_the_end(found_.current.model())) found_.current = std::move(*fitted);
  found_.rivals.clear();
  found_.near.clear();
  for (Candidate& candidate : found_.candidates) candidate.held_out_error.reset();
  swap();
  prune();
  if (rivals_are_stale_) swap(), renew_rivals();  // beside fewer members
  for (std::size_t i = 0; i < found_.effects.size(); ++i) {
    if (needed(found_.effects[i], found_.current.model())) continue;
    const Round* reduced = round_without(i);
    if (reduced == nullptr) continue;
    for (const Addition& a : reduced->refits) remember(a.score, error_with(a));
  }
  return std::move(found_);
}

Finding Search::gone_on(std::size_t longest_list) {
  longest_list_ = longest_list;
  if (found_.effects.empty()) return run();
  forward();
  settle();
  try_all_in_the_place_of_each();
  renew_rivals();
  return std::move(found_);
}

Finding Search::run() {
  forward();
  try_cogging_first();
  try_fewer();
  settle();
  try_all_in_the_place_of_each();
  if (rivals_are_stale_) renew_rivals();
  return std::move(found_);
}

const Trial* Search::first_step() {
  const bool added = add_best(rounds_.of(found_.effects, found_.current));
  return added && removes_most(as_given_, found_.current.held_out) ? &found_.current : nullptr;
}

/// Until no effect more, fewer or in the place of another makes the model better; each pass may open what the one
/// before it closed.
void Search::settle() {
  constexpr int most = 3;  // passes: two suffice but where models take turns
  for (int pass = 0; pass < most; ++pass) {
    if (pass > 0 && trials_.exhausted()) return;
    swap();
    const std::vector<std::size_t> before = found_.effects;
    prune();
    forward();
    if (found_.effects == before) return;
    rivals_are_stale_ = true;
  }
}

/// Adds what removes most, until nothing material is left to remove.
void Search::forward() {
  while (found_.effects.size() < longest_list_ && !trials_.exhausted()) {
    tell(0.1 + 0.45 * static_cast<double>(found_.effects.size()) / static_cast<double>(longest_list_),
         "scoring absent effects");
    Round& of_current = rounds_.of(found_.effects, found_.current);
    if (!add_best(of_current) && !add_pair(of_current) && !add_what_the_scores_passed_by(of_current) &&
        !add_beside_what_is_alike()) {
      break;
    }
  }
}

/// Where much is left and nothing promising mends it, each effect is refitted before that is said, also those whose
/// first steps do little; if none helps alone, two in turn: where the model is not far off, that which helps most, but
/// by values that it cannot have, which may be since the other is missing beside. Between two that bend a parameter
/// each its own way, as dry friction and windage do B, neither helps runs that it was not fitted to: two such have to
/// explain all that is left, for two of anything explain something.
bool Search::add_what_the_scores_passed_by(Round& of_current) {
  if (!criterion_.worth_trying_all(found_.current.held_out) || trials_.exhausted()) return false;
  tell(0.5, "trying all effects");
  const std::vector<Addition>& all = rounds_.all_refits_of(of_current);
  if (add_best_of(all) || add_best_of(rounds_.slow_refits_of(of_current))) return true;
  if (criterion_.far_off(found_.current.held_out)) return add_two_in_turn(of_current, all);
  const Addition* refused = nullptr;  // the best of them
  for (const Addition& a : all) {
    const bool helps = criterion_.worth_a_step(found_.current.held_out, a.trial.held_out);
    if (!dropped_.contains(a.effect()) && helps && (refused == nullptr || a.trial.fit.cost < refused->trial.fit.cost))
      refused = &a;
  }
  if (refused != nullptr && add_two_in_turn(of_current, {*refused})) return true;
  std::vector<Addition> others = all;
  if (refused != nullptr) std::erase_if(others, [&](const Addition& a) { return a.effect() == refused->effect(); });
  return add_two_in_turn(of_current, others, PairExplains::all);
}

/// Half of the truth may foretell new runs worse than nothing: a weight that no friction holds swings on. What helps in
/// training is followed by one step, and judged by that.
bool Search::add_two_in_turn(const Round& of_current, const std::vector<Addition>& first_steps, PairExplains explains) {
  std::optional<Pair> best;
  for (const Addition* step : near_the_best(first_steps, of_current.fitted.fit.cost, {})) {
    if (trials_.exhausted()) break;
    std::vector<std::size_t> with = found_.effects;
    with.push_back(step->effect());
    for (const Addition& second : rounds_.explored(with, [&] { return step->trial; })->refits) {
      const Trial& both = second.trial;
      if (!removes_most(found_.current.held_out, both.held_out)) continue;
      if (explains == PairExplains::all && criterion_.remainder(both.held_out)) continue;
      if (!criterion_.worth_a_step(found_.current.held_out, both.held_out)) continue;
      if (best && !likelier(both.held_out, best->trial.held_out)) continue;
      if (!told(both, step->effect(), found_.current.held_out) || !told(both, second.effect(), step->trial.held_out))
        continue;
      best = Pair{{step->effect(), second.effect()}, both};
    }
  }
  if (best) take(std::move(*best));
  return best.has_value();
}

bool Search::add_best(Round& of_current) {
  for (const Score& s : of_current.scores) remember(s, {});
  if (add_best_of(of_current.refits)) return true;
  const std::optional<Addition>& whole = rounds_.whole_orders_of(of_current);
  return whole && add_best_of({*whole});
}

/// Adds the best of some refits of the current model with one effect more, if any is worth it.
bool Search::add_best_of(std::vector<Addition> additions) {
  const Trial& current = found_.current;
  for (const Addition& a : additions) remember(a.score, error_with(a));
  std::erase_if(additions, [&](const Addition& a) {
    return dropped_.contains(a.effect()) ||
           mends_another(a.effect(), found_.effects, current.held_out, a.trial.held_out) ||
           !shows_itself(current.model().about(a.effect()), current.held_out, a.trial.held_out) ||
           !criterion_.beyond_the_laws(as_given_, current.held_out, a.trial.held_out);
  });
  std::optional<Trial> kept;
  std::optional<Addition> best = best_that_stays(additions, kept);
  if (!best) return false;
  std::erase_if(additions, [&](const Addition& a) {
    return a.effect() == best->effect() || !criterion_.tied(best->trial.held_out, a.trial.held_out);
  });
  found_.alike.insert_or_assign(best->effect(), std::move(additions));
  found_.add(best->effect(), std::move(*kept));
  remember(best->score, current.held_out_error());
  return true;
}

/// The best of some refits that the data determine and that stays material when it is fitted to the end: not only where
/// a descent was broken off.
/// @param additions those that do not are erased @param kept its fit to the end
std::optional<Addition> Search::best_that_stays(std::vector<Addition>& additions, std::optional<Trial>& kept) {
  while (const Addition* best = best_of(additions, found_.current)) {
    if (trials_.determined(best->trial.model(), best->effect())) {
      kept = trials_.fit_from_elsewhere_too(best->trial.model());
      if (kept && criterion_.worth_a_step(found_.current.held_out, kept->held_out)) return *best;
    }
    std::erase_if(additions, [effect = best->effect()](const Addition& a) { return a.effect() == effect; });
  }
  return std::nullopt;
}

/// Do the data tell an effect by its size, or while most is left, by what it carries? Where several parameters go with
/// each other no error tells one of them.
bool Search::told(const Trial& with, std::size_t effect, const Loss& without) {
  if (trials_.determined(with.model(), effect)) return true;
  const bool most_is_left = !removes_most(as_given_, without);
  return most_is_left && carries_most(without, with.held_out) && trials_.can_be(with.model(), effect);
}

/// The best of several refits that all removed something material: lowest loss, but at equal gain the fewest
/// parameters.
const Addition* Search::best_of(const std::vector<Addition>& additions, const Trial& current) const {
  const Addition* best = nullptr;
  for (const Addition& a : additions) {
    if (criterion_.worth_a_step(current.held_out, a.trial.held_out) &&
        (best == nullptr || likelier(a.trial.held_out, best->trial.held_out))) {
      best = &a;
    }
  }
  if (best == nullptr) return nullptr;
  const auto parameter_count = [](const Addition& a) { return a.trial.model().about(a.effect()).parameter_count; };
  for (const Addition& a : additions) {
    if (parameter_count(a) < parameter_count(*best) && criterion_.worth_a_step(current.held_out, a.trial.held_out) &&
        criterion_.tied(best->trial.held_out, a.trial.held_out)) {
      best = &a;
    }
  }
  return best;
}

bool Search::add_pair(Round& of_current) {
  const std::optional<Pair>& two = rounds_.two_of(of_current, found_.effects);
  if (two) take(*two);
  return two.has_value();
}

void Search::take(Pair two) {
  for (const std::size_t effect : two.effects) {
    found_.effects.push_back(effect);
    found_.before.insert_or_assign(effect, found_.current.held_out);
    found_.steps.push_back({"added " + id(effect), effect, two.trial.train, two.trial.held_out_error()});
  }
  found_.current = std::move(two.trial);
}

/// Friction comes near enough to cogging to be taken first. Cogging is tried only where it explains most runs: a wave
/// does a little of anything. Where nothing was found, it was tried in that very round.
void Search::try_cogging_first() {
  if (found_.effects.empty() || !criterion_.remainder(found_.current.held_out) || trials_.exhausted() ||
      found_.current.model().about(found_.effects.front()).is_detent()) {
    return;
  }
  tell(0.55, "trying cogging first");
  std::optional<Chain> chain = cogging_first(rounds_.first(), found_.effects.size() + 1);
  if (!chain || !trials_.explains_most_runs(chain->trial) ||
      !criterion_.material(found_.current.held_out, chain->trial.held_out)) {
    return;
  }
  found_.current = std::move(chain->trial);
  found_.before = std::move(chain->before);
  found_.effects = std::move(chain->effects);
  for (const std::size_t effect : found_.effects) {
    found_.steps.push_back(
        {"added " + id(effect) + " instead", effect, found_.current.train, found_.current.held_out_error()});
  }
}

/// @param most so many effects in all
std::optional<Search::Chain> Search::cogging_first(Round& bare, std::size_t most) {
  Chain chain{{}, {}, bare.fitted};
  std::optional<Addition> next = rounds_.whole_orders_of(bare);
  while (next && chain.effects.size() < most && !trials_.exhausted() &&
         trials_.determined(next->trial.model(), next->effect())) {
    chain.before.insert_or_assign(next->effect(), chain.trial.held_out);
    chain.effects.push_back(next->effect());
    chain.trial = std::move(next->trial);
    const Round& after = *rounds_.explored(chain.effects, [&] { return chain.trial; });
    const Addition* best = best_of(after.refits, chain.trial);
    next = best != nullptr ? std::optional(*best) : std::nullopt;
  }
  if (chain.effects.empty()) return std::nullopt;
  if (auto kept = trials_.fit_to_the_end(chain.trial.model())) chain.trial = std::move(*kept);
  return chain;
}

/// What took three or more may be two that the first step passed by.
void Search::try_fewer() {
  if (found_.effects.size() < 3 || trials_.exhausted()) return;
  tell(0.58, "trying fewer");
  std::optional<Pair> two = fewer(rounds_.first(), found_.current, found_.effects.front());
  if (!two) return;
  const Loss first = found_.before.at(found_.effects.front());
  found_.effects.assign(two->effects.begin(), two->effects.end());
  for (const std::size_t effect : found_.effects) found_.before.insert_or_assign(effect, first);
  found_.steps.push_back({id(two->effects[0]) + " and " + id(two->effects[1]) + " instead",
                          {},
                          two->trial.train,
                          two->trial.held_out_error()});
  found_.current = std::move(two->trial);
}

/// Two effects that explain all that the many do which were pieced together one by one, and leave nothing: the first
/// step takes what removes most, which may be neither of them. So each of the others that came near is followed by
/// one step.
std::optional<Pair> Search::fewer(const Round& first, const Trial& many, std::size_t begun_with) {
  std::optional<Pair> found;
  for (const Addition* step : near_the_best(first.refits, first.fitted.fit.cost, begun_with)) {
    if (trials_.exhausted()) break;
    for (const Addition& second : rounds_.explored({step->effect()}, [&] { return step->trial; })->refits) {
      const Trial& both = second.trial;
      if (found && found->trial.held_out.error() <= both.held_out.error()) continue;
      if (criterion_.remainder(both.held_out)) continue;
      if (criterion_.material(both.held_out, many.held_out)) continue;
      if (!told(both, step->effect(), first.fitted.held_out) || !told(both, second.effect(), step->trial.held_out))
        continue;
      found = Pair{{step->effect(), second.effect()}, both};
    }
  }
  return found;
}

/// What the others have made superfluous goes. Where something is left, drops of which each does little wait before
/// they together undo what was found, until others were tried beside what stayed.
void Search::prune() {
  const Loss before = found_.current.held_out;
  const auto undoes = [&](const Trial& without) {
    return criterion_.remainder(without.held_out) && criterion_.material(without.held_out, before) &&
           !criterion_.material(without.held_out, found_.current.held_out);
  };
  for (std::size_t i = 0; i < found_.effects.size();) {
    tell(0.85, "pruning");
    const std::size_t effect = found_.effects[i];
    std::optional<Trial> without;
    if (needed(effect, found_.current.model()) || !superfluous(effect, without) || undoes(*without)) {
      ++i;
      continue;
    }
    found_.steps.push_back({"dropped " + id(effect), {}, without->train, without->held_out_error()});
    found_.current = std::move(*without);
    found_.rivals.erase(effect);
    found_.near.erase(effect);
    rivals_are_stale_ = true;
    dropped_.insert(effect);
    found_.effects.erase(found_.effects.begin() + static_cast<std::ptrdiff_t>(i));
    i = 0;  // what stood before it may have been needed by it
  }
}

/// Does the model do without an effect? @param without its fit without
bool Search::superfluous(std::size_t effect, std::optional<Trial>& without) {
  const Trial& current = found_.current;
  without = fit_without(effect);
  const auto worse_without = [&] {
    return !without || (criterion_.material(without->held_out, current.held_out) &&
                        criterion_.beyond_the_laws(as_given_, without->held_out, current.held_out));
  };
  bool stays = worse_without();
  // A fit without it may have lost its way: from a model that it bent before another explained what is there.
  const bool may_be_lost = found_.effects.size() > 1 && without && criterion_.remainder(without->held_out);
  if (stays && without && (may_be_lost || !trials_.determined(current.model(), effect))) {
    if (auto again = trials_.fit_from_elsewhere_too(without->model())) without = std::move(again);
    stays = worse_without();
  }
  if (stays && without && mends_another(effect, found_.effects, without->held_out, current.held_out)) {
    // The lesser of the two goes.
    const auto other = fit_without(*same_family_as(effect, found_.effects, current));
    stays = other && other->held_out.error() < without->held_out.error();
  }
  return !stays;
}

/// Two that shape the same edges: of a filter with two poles, a lag leaves what a delay takes away. Another effect is
/// one that removes a material share of what was there before both.
bool Search::mends_another(std::size_t effect, const std::vector<std::size_t>& others, const Loss& without,
                           const Loss& with) const {
  const auto other = same_family_as(effect, others, found_.current);
  if (!other) return false;
  const auto own = found_.before.find(effect);
  const Loss& of_other = found_.before.at(*other);
  const Loss& both = own != found_.before.end() && own->second.error() > of_other.error() ? own->second : of_other;
  return !criterion_.material_beside_same_edges(both, without, with);
}

std::optional<Trial> Search::fit_without(std::size_t effect) {
  Model without = found_.current.model();
  without.exclude(effect);
  return trials_.fit(without, known_for(effect, found_.current));
}

void Search::remember(const Score& score, std::optional<double> held_out) {
  std::vector<Candidate>& candidates = found_.candidates;
  auto known = std::ranges::find(candidates, score.effect, [](const Candidate& c) { return c.score.effect; });
  if (known == candidates.end()) known = candidates.insert(candidates.end(), Candidate{score, {}});
  // The first score stands: it says what the effect would have explained of the model as it was given. What is
  // detectable is told by the last, when the others have been repaired.
  known->score.detectable_size = score.detectable_size;
  if (held_out && (!known->held_out_error || *held_out < *known->held_out_error)) known->held_out_error = held_out;
}

void Search::tell(double share, const std::string& doing) {
  told_ = std::max(told_, share);
  if (progress_) progress_(told_, doing);
}

std::string Search::id(std::size_t effect) const { return std::string(found_.current.model().about(effect).id); }

}  // namespace emtb
