#include "tests/blind/wide/wide_case.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "hal/error.h"
#include "tests/blind/wide/garbage.h"
#include "tests/blind/wide/visibility.h"

namespace emtb::blind::wide {
namespace {

constexpr std::array<std::string_view, 6> kinds{"healthy", "single", "pair", "triple", "outside", "garbage"};

/// Puts a friction, a fan or a soft shaft into the plant, of which the model knows.
void give(WideCase& c, std::string_view id, Draw& draw) {
  if (std::ranges::find(c.given, id) != c.given.end()) return;
  const Machine& m = c.bench.machine;
  if (id == "coulomb_friction") c.bench.plant.friction.T_c = 0.15 * m.torque * draw.within(0.7, 1.3);
  if (id == "windage") c.bench.plant.motor.windage = 0.6 * m.torque / (m.speed * m.speed) * draw.within(0.7, 1.3);
  if (id == "shaft_compliance") wide_effect(id).hide(c.bench, 0.6, draw);
  c.given.emplace_back(id);
}

/// Things that this bench can hide beside each other.
std::vector<const WideEffect*> draw_subjects(const WideBench& bench, Kind kind, Draw& draw) {
  const std::size_t wanted = kind == Kind::triple ? 3 : kind == Kind::pair ? 2 : 1;
  std::vector<const WideEffect*> list;
  for (int n = 0; n < 60 && list.size() < wanted; ++n) {
    const WideEffect& e = wide_effects()[draw.below(wide_effects().size())];
    if (e.outside != (kind == Kind::outside) || (e.possible != nullptr && !e.possible(bench))) continue;
    if (wanted > 1 && !e.sized) continue;
    const bool fits = std::ranges::all_of(list, [&](const WideEffect* other) {
      return other->id != e.id && other->given != e.id && e.given != other->id;
    });
    if (fits) list.push_back(&e);
  }
  if (list.size() < wanted) list.clear();
  return list;
}

/// The size at which an effect is about so visible; nothing where none that is plausible is.
std::optional<double> size_for(const WideEffect& what, const WideBench& bench, const Visibility& visibility,
                               double wanted, const Draw& shape) {
  const auto visible_at = [&](double size) {
    WideBench other = bench;
    what.hide(other, size, shape);
    return visibility.of(other);
  };
  if (!what.sized) return visible_at(1) >= 1 ? std::optional(1.0) : std::nullopt;
  double size = 1;
  for (int n = 0; n < 7; ++n) {
    const double visible = visible_at(size);
    if (!std::isfinite(visible)) return std::nullopt;
    const bool at_most = size >= what.largest, enough = visible >= 1;
    if (std::abs(std::log(visible / wanted)) < 0.2 || (at_most && visible < wanted)) {
      return enough ? std::optional(size) : std::nullopt;
    }
    if (n == 6) return enough && visible < 3 * wanted ? std::optional(size) : std::nullopt;
    size = std::clamp(size * std::clamp(wanted / std::max(visible, 1e-6), 0.1, 6.0), 0.02, what.largest);
  }
  return std::nullopt;
}

bool hide(WideCase& c, const std::vector<const WideEffect*>& what, std::uint64_t seed, Draw& draw) {
  for (const WideEffect* e : what) {
    if (!e->given.empty()) give(c, e->given, draw);
  }
  const WideBench plain = c.bench;
  const Visibility visibility(plain, seed);
  std::vector<Draw> shapes;
  for (const WideEffect* e : what) {
    shapes.emplace_back(draw.seed());
    const auto size = size_for(*e, plain, visibility, draw.log_within(1.2, 5), shapes.back());
    if (!size) return false;
    c.truths.push_back({std::string(e->id), *size, {}, aliases(e->id, plain)});
  }
  const auto with_all_but = [&](std::size_t left_out) {
    WideBench bench = plain;
    for (std::size_t i = 0; i < what.size(); ++i) {
      if (i == left_out) continue;
      auto parameters = what[i]->hide(bench, c.truths[i].size, shapes[i]);
      if (left_out < what.size()) continue;
      if (plain.plant.laws == simulated::Laws::usual) c.truths[i].parameters = parameters;
      c.about.push_back(std::move(parameters));
    }
    return bench;
  };
  c.bench = with_all_but(what.size());
  c.visible = visibility.of(c.bench);
  // One may hide the other.
  for (std::size_t i = 0; what.size() > 1 && i < what.size(); ++i) {
    if (visibility.of(c.bench, with_all_but(i)) < 0.6) return false;
  }
  return true;
}

/// The readings are numbers, and the bench is one that somebody would record: it moves.
bool sane(const WideCase& c) {
  for (const auto* runs : {&c.train, &c.held_out, &c.secret}) {
    for (const Run& run : *runs) {
      for (const auto& [signal, series] : run.signals) {
        if (series.value.size() < 3 || !std::ranges::all_of(series.value, [](double v) { return std::isfinite(v); })) {
          return false;
        }
      }
    }
  }
  return true;
}

std::vector<Run> record_all(const WideBench& bench, const std::vector<Experiment>& list, std::uint64_t seed) {
  std::vector<Run> runs;
  for (std::size_t n = 0; n < list.size(); ++n) {
    runs.push_back(record(bench, list[n], SplitMix64(seed + 7919 * (n + 1)).next()).run);
  }
  return runs;
}

}  // namespace

std::string_view name_of(Kind kind) noexcept { return kinds[static_cast<std::size_t>(kind)]; }

std::optional<Kind> wide_kind_named(std::string_view name) noexcept {
  const auto found = std::ranges::find(kinds, name);
  if (found == kinds.end()) return std::nullopt;
  return static_cast<Kind>(found - kinds.begin());
}

WideCase make_wide_case(Kind kind, std::size_t number, std::uint64_t base_seed) {
  const std::string id = std::string(name_of(kind)) + ":" + std::to_string(number);
  std::uint64_t seed = SplitMix64(base_seed * 1'000'003 + static_cast<std::uint64_t>(kind) * 100'000 + number).next();
  for (int attempt = 0; attempt < 60; ++attempt, ++seed) {
    Draw draw(seed);
    WideCase c;
    c.id = id;
    c.kind = kind;
    c.seed = seed;
    c.bench = draw_bench(draw);
    // What is hidden is drawn for the bench; where it does not show there, something else, then another bench.
    const bool hides = kind != Kind::healthy && kind != Kind::garbage;
    bool done = !hides;
    for (int n = 0; n < 3 && !done; ++n) {
      WideCase with = c;
      const auto subjects = draw_subjects(c.bench, kind, draw);
      if (subjects.empty() || !hide(with, subjects, seed >> 1U, draw)) continue;
      c = std::move(with);
      done = true;
    }
    if (!done) continue;
    c.train = record_all(c.bench, c.bench.train, seed);
    c.held_out = record_all(c.bench, c.bench.held_out, seed ^ 0x5555);
    c.secret = record_all(c.bench, c.bench.secret, seed ^ 0xaaaa);
    if (!sane(c)) continue;
    if (kind == Kind::garbage) c.garbage = plant_garbage(c, draw);
    return c;
  }
  throw ModelError(id + ": no bench shows what was drawn for it");
}

}  // namespace emtb::blind::wide
