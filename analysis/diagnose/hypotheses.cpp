#include "analysis/diagnose/hypotheses.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "analysis/diagnose/moves.h"
#include "analysis/numerics/orders.h"
#include "model/catalogue.h"

namespace emtb {
namespace {

/// The orders that stand out of what is left of the speed.
std::vector<Order> orders_left(const NullFit& fitted) {
  std::vector<TurningStretch> stretches;
  for_each_fast_speed(fitted,
                      [&](const Record& record, const Observation& o, std::vector<double> left, double interval) {
                        const Excitation& x = record.excitation;
                        if (x.angle.empty()) return;
                        TurningStretch stretch{{}, without_slow_changes(std::move(left), interval)};
                        for (std::size_t i = 0; i < o.size(); ++i)
                          stretch.angle.push_back(x.angle[(o.first[i] + o.last[i]) / 2]);
                        stretches.push_back(std::move(stretch));
                      });
  return strong_orders(stretches, 3);
}

/// Where a search for a formula starts: each shape as given, then half way to each of its bounds.
std::vector<StartValues> starts_of_formula(const EffectInfo& about) {
  StartValues given{};
  for (std::size_t i = 0; i < about.parameter_count; ++i) given[i] = about.parameter_list[i].null;
  std::vector<StartValues> all{given};
  for (std::size_t i = 0; i < about.parameter_count; ++i) {
    const EffectParameter& p = about.parameter_list[i];
    if (!p.is_shape()) continue;
    for (const double bound : {p.min, p.max}) {
      if (bound == p.null) continue;
      StartValues at = given;  // half way by ratio: sizes are guessed within a factor
      at[i] = bound * p.null > 0 ? std::copysign(std::sqrt(bound * p.null), bound) : 0.5 * (bound + p.null);
      all.push_back(at);
    }
  }
  return all;
}

}  // namespace

std::vector<Hypothesis> hypotheses_of(const NullFit& fitted, std::span<const std::size_t> candidates,
                                      bool whole_orders) {
  std::vector<Hypothesis> all;
  std::optional<std::vector<Order>> orders;
  for (const std::size_t effect : candidates) {
    const EffectInfo& about = fitted.model.about(effect);
    if (about.at_null == AtNull::nothing && !makes_sense(effect, fitted.model)) continue;
    if (!about.periodic) {
      bool whole = about.fades();
      for (StartValues at : effect < effect_count ? starts_of(effect, fitted.seen) : starts_of_formula(about)) {
        const EffectParameter& first = about.parameter_list[0];
        if (!whole && first.role == Role::limit && at[0] == first.null) {  // no limit: no slope leads away from there
          whole = true;
          continue;
        }
        for (std::size_t i = 0; i < about.parameter_count; ++i) {
          const EffectParameter& parameter = about.parameter_list[i];
          if (!whole && parameter.role == Role::amplitude) at[i] = parameter.null;
        }
        all.push_back({effect, &about, at, whole});
        whole = whole || about.at_null == AtNull::small;  // the first of those is its null
      }
      continue;
    }
    const auto order_place = about.place_of(Role::order);
    if (!order_place) {  // once a turn
      all.push_back({effect, &about, {}, false});
      continue;
    }
    const auto add_order = [&](double per_turn) {
      Hypothesis h{effect, &about, {}, false};
      const EffectParameter& p = about.parameter_list[*order_place];
      if (per_turn < p.min || per_turn > p.max) return;
      h.at[*order_place] = per_turn;
      all.push_back(h);
    };
    if (whole_orders) {
      for (const int n : {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 14, 15, 16, 18, 20, 22, 24}) add_order(n);
      continue;
    }
    if (!orders) orders = orders_left(fitted);
    for (const Order& order : *orders) {
      constexpr double scale = 0.01;  // of the measured angle, which may be off by as much
      const double whole = std::round(order.per_turn), off = std::abs(order.per_turn - whole);
      add_order(order.per_turn);
      if (whole > 0 && off > 1e-4 * whole && off < scale * whole) add_order(whole);
    }
  }
  // Those that need the short step share their simulations.
  std::ranges::stable_partition(all, [](const Hypothesis& h) { return !h.about().quick; });
  return all;
}

}  // namespace emtb
