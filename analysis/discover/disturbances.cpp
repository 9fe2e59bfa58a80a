#include "analysis/discover/disturbances.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "analysis/numerics/parallel.h"
#include "analysis/numerics/statistics.h"
#include "session/spec.h"
#include "session/text.h"

namespace emtb {
namespace {

constexpr double scatters = 6, errors = 4, tail = 2, own_part = 0.5;
constexpr double most = 0.05;              // of the motion
constexpr std::size_t most_stretches = 4;  // what comes more often is no exception
constexpr double near = 0.1;               // of the ranges of speed and current: intervals are alike
constexpr double small = 0.1;              // of the largest impulse
constexpr std::size_t fewest_intervals = 5;
constexpr std::size_t fewest_to_recur = 3;
constexpr std::size_t bridged = 2;  // intervals between two that stand out

/// One interval of a run.
struct Interval {
  std::size_t run = 0, k = 0;
  double omega = 0, i_a = 0;  ///< as shares of the largest
  double torque = 0, error = 0;
  double off = 0;    ///< torque less what is missing in intervals like it
  double limit = 0;  ///< [N m] a standard deviation of `off`, the largest of all, of those like it and of its run
  bool comes_elsewhere = false;  ///< its speed and current
  bool disturbed = false;        ///< within a stretch that is found: nothing is usual there
  /// Beyond chance; and most of it is missing here, not in those like it that a torque acted on.
  bool out() const { return std::abs(off) > std::max(scatters * limit, errors * error) && torque / off > own_part; }
  /// Does as much of a torque, or nearly, lack where nothing like it tells what is usual?
  bool lacks(double of) const { return !comes_elsewhere && torque / of > own_part; }
};

std::vector<Interval> intervals_of(const WhatIsLeft& left) {
  double fastest = 0, largest = 0;
  for (const MissingTorque& run : left.runs) {
    for (std::size_t k = 0; k < run.t.size(); ++k) {
      fastest = std::max(fastest, std::abs(run.omega[k]));
      largest = std::max(largest, std::abs(run.i_a_smoothed[k]));
    }
  }
  const auto part = [](double x, double of) { return of > 0 ? x / of : 0; };
  std::vector<Interval> all;
  for (std::size_t r = 0; r < left.runs.size(); ++r) {
    const MissingTorque& run = left.runs[r];
    for (std::size_t k = 0; k < run.t.size(); ++k) {
      all.push_back(
          {r, k, part(run.omega[k], fastest), part(run.i_a_smoothed[k], largest), run.torque[k], run.torque_error[k]});
    }
  }
  return all;
}

bool at_like_speed(const Interval& a, const Interval& b) { return std::abs(a.omega - b.omega) < near; }
bool at_like_current(const Interval& a, const Interval& b) { return std::abs(a.i_a - b.i_a) < near; }
bool alike(const Interval& a, const Interval& b) { return at_like_speed(a, b) && at_like_current(a, b); }

/// The middle of some torques, and how they scatter about it.
struct Usual {
  double middle = 0, scatter = 0;
};

Usual usual(std::vector<double> torque) {
  Usual u;
  u.middle = median(torque);
  for (double& t : torque) t = std::abs(t - u.middle);
  u.scatter = robust_sigma(std::move(torque));
  return u;
}

/// What is missing at the speed and current of an interval, so many intervals or more from it; where no other has both,
/// at its speed, and beside that at its current. None where that comes nowhere.
std::optional<Usual> usual_like(const Interval& here, const std::vector<Interval>& all, std::size_t apart) {
  constexpr std::size_t fewest = 10;
  std::vector<double> both, speed, current;
  for (const Interval& other : all) {
    const bool same_time = other.run == here.run && other.k + apart > here.k && other.k < here.k + apart;
    if (same_time || other.disturbed) continue;
    const bool w = at_like_speed(here, other), i = at_like_current(here, other);
    if (w && i) both.push_back(other.torque);
    if (w) speed.push_back(other.torque);
    if (i) current.push_back(other.torque);
  }
  if (both.size() >= fewest) return usual(std::move(both));
  if (speed.size() < fewest || current.size() < fewest) return {};
  const Usual at_speed = usual(std::move(speed)), at_current = usual(std::move(current));
  return Usual{at_speed.middle + at_current.middle, std::max(at_speed.scatter, at_current.scatter)};
}

/// As far from it as a disturbance may last; where it comes nowhere else, half of that.
std::optional<Usual> elsewhere(const Interval& here, const std::vector<Interval>& all) {
  const auto longest = static_cast<std::size_t>(most * static_cast<double>(all.size()));
  const std::optional<Usual> far = usual_like(here, all, longest);
  return far ? far : usual_like(here, all, longest / 2);
}

/// Sets how far each interval is off those like it, and how far they scatter.
void compare_with_like(std::vector<Interval>& all) {
  std::vector<double> scatter(all.size(), 0.0), sizes;
  parallel_for(all.size(), [&](std::size_t i) {
    const std::optional<Usual> there = elsewhere(all[i], all);
    all[i].comes_elsewhere = there.has_value();
    all[i].off = there ? all[i].torque - there->middle : 0;
    scatter[i] = there ? there->scatter : 0;
  });
  std::map<std::size_t, std::vector<double>> of_run;
  for (const Interval& one : all) {
    if (one.disturbed || !one.comes_elsewhere) continue;
    sizes.push_back(std::abs(one.off));
    of_run[one.run].push_back(std::abs(one.off));
  }
  const double overall = sizes.empty() ? 0 : robust_sigma(std::move(sizes));
  std::map<std::size_t, double> own;  // of each run: what comes and goes all the time is no disturbance
  for (auto& [run, off] : of_run) own[run] = robust_sigma(std::move(off));
  for (std::size_t i = 0; i < all.size(); ++i) all[i].limit = std::max({overall, scatter[i], own[all[i].run]});
}

/// Neighbours that stand out, as places in the list: [begin, end).
struct Stretch {
  std::size_t begin = 0, end = 0;
  std::size_t size() const { return end - begin; }
};

std::vector<Stretch> stretches_in(const std::vector<Interval>& all) {
  std::vector<Stretch> found;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].disturbed) continue;
    const bool same_run = !found.empty() && all[found.back().begin].run == all[i].run;
    if (all[i].out()) {
      const bool goes_on = same_run && i <= found.back().end + bridged && all[found.back().begin].off * all[i].off > 0;
      if (!goes_on) found.push_back({i, i});
      found.back().end = i + 1;
    } else if (same_run && i == found.back().end && all[i].lacks(all[found.back().begin].off)) {
      found.back().end = i + 1;  // a large torque soon drives the shaft where it never is without it
    }
  }
  std::erase_if(found, [](const Stretch& s) { return s.size() < fewest_intervals; });
  return found;
}

double mean_off(const Stretch& s, const std::vector<Interval>& all) {
  double sum = 0;
  for (std::size_t i = s.begin; i < s.end; ++i) sum += all[i].comes_elsewhere ? all[i].off : all[i].torque;
  return sum / static_cast<double>(s.size());
}

double impulse(const Stretch& s, const std::vector<Interval>& all) {
  return std::abs(mean_off(s, all)) * static_cast<double>(s.size());
}

/// As far as its neighbours are off on the same side by more than chance; where nothing is like them, as far as they
/// lack about the same.
void widen(Stretch& s, const std::vector<Interval>& all) {
  const std::size_t run = all[s.begin].run;
  const double torque = mean_off(s, all);
  std::size_t alike_left = 2 * s.size();
  const auto belongs = [&](std::size_t i) {
    const Interval& one = all[i];
    if (one.run != run || one.disturbed) return false;
    if (!one.comes_elsewhere) return one.lacks(torque);
    return one.off * torque > 0 && std::abs(one.off) > tail * std::max(one.limit, one.error) && alike_left-- > 0;
  };
  while (s.begin > 0 && belongs(s.begin - 1)) --s.begin;
  while (s.end < all.size() && belongs(s.end)) ++s.end;
}

/// Do as many intervals like one of a stretch come elsewhere without it, or enough to be sure? Like in speed and
/// current, or some in the one and some in the other.
bool recurs_without(const Interval& one, const Stretch& s, const std::vector<Interval>& all) {
  constexpr double enough = 20;
  double both = 0, speed = 0, current = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if ((i + fewest_intervals >= s.begin && i < s.end + fewest_intervals) || all[i].out()) continue;
    both += alike(all[i], one) ? 1 : 0;
    speed += at_like_speed(all[i], one) ? 1 : 0;
    current += at_like_current(all[i], one) ? 1 : 0;
  }
  const double n = std::min(enough, static_cast<double>(s.size()));
  return both >= n || (speed >= n && current >= n);
}

/// In so many of its intervals the torque hangs on no speed and current: these come elsewhere without it.
bool recurs_without(const Stretch& s, const std::vector<Interval>& all) {
  std::size_t recurring = 0;
  for (std::size_t i = s.begin; i < s.end && recurring < fewest_to_recur; ++i)
    recurring += all[i].out() && recurs_without(all[i], s, all) ? 1 : 0;
  return recurring == fewest_to_recur;
}

/// The stretch that stands out most, by its impulse. A torque that is not usual makes what comes elsewhere at its
/// speed and current look unusual, by as much and for a shorter time: those are asked again without it.
std::optional<Stretch> strongest(std::vector<Interval>& all, double least_torque) {
  compare_with_like(all);
  std::optional<Stretch> found;
  double largest = 0;
  for (Stretch s : stretches_in(all)) {
    if (!recurs_without(s, all)) continue;
    widen(s, all);
    if (std::abs(mean_off(s, all)) < least_torque || impulse(s, all) <= largest) continue;
    largest = impulse(s, all);
    found = s;
  }
  return found;
}

/// Stretches of one sign with nothing or little between them are one.
std::vector<Stretch> joined(std::vector<Stretch> found, const std::vector<Interval>& all) {
  std::ranges::sort(found, {}, &Stretch::begin);
  std::vector<Stretch> one;
  for (const Stretch& s : found) {
    const bool goes_on = !one.empty() && all[one.back().begin].run == all[s.begin].run &&
                         s.begin <= one.back().end + bridged && mean_off(one.back(), all) * mean_off(s, all) > 0;
    if (goes_on) {
      one.back().end = s.end;
    } else {
      one.push_back(s);
    }
  }
  return one;
}

/// What is small beside the strongest is no disturbance of its own, but what a model that bent to that one lacks.
void drop_small(std::vector<Stretch>& found, const std::vector<Interval>& all) {
  double largest = 0;
  for (const Stretch& s : found) largest = std::max(largest, impulse(s, all));
  std::erase_if(found, [&](const Stretch& s) { return impulse(s, all) < small * largest; });
}

/// Somebody's hand acts in one run as it likes. What acts in several is a thing, and does the same each time, and
/// seldom: torques of many sizes and signs all over the runs are what the law of something leaves that the model lacks.
bool may_be_one_thing(const std::vector<Stretch>& found, const std::vector<Interval>& all, std::size_t runs) {
  constexpr double alike_to = 2;  // times
  constexpr double most_of_runs = 1.0 / 3;
  std::set<std::size_t> in;
  double least = HUGE_VAL, largest = -HUGE_VAL;
  for (const Stretch& s : found) {
    in.insert(all[s.begin].run);
    least = std::min(least, mean_off(s, all));
    largest = std::max(largest, mean_off(s, all));
  }
  if (in.size() <= 1) return true;
  const double ratio = largest / least;  // negative: of two signs
  return ratio >= 1 / alike_to && ratio <= alike_to &&
         static_cast<double>(in.size()) <= most_of_runs * static_cast<double>(runs);
}

}  // namespace

std::vector<Disturbance> disturbances_in(const WhatIsLeft& left) {
  constexpr double material = 0.02;  // of what drives the motor: no machine is known better
  std::vector<Interval> all = intervals_of(left);
  if (all.empty()) return {};
  std::vector<Stretch> found;
  double disturbed = 0, largest = 0;
  while (const std::optional<Stretch> s = strongest(all, material * left.torque_scale)) {
    const double its = impulse(*s, all);
    largest = std::max(largest, its);
    if (its < small * largest) break;
    found.push_back(*s);
    disturbed += static_cast<double>(s->size());
    if (disturbed > most * static_cast<double>(all.size())) return {};
    for (std::size_t i = s->begin; i < s->end; ++i) all[i].disturbed = true;
  }
  compare_with_like(all);  // with what is usual where none of them is
  found = joined(std::move(found), all);
  drop_small(found, all);
  if (found.size() > most_stretches || !may_be_one_thing(found, all, left.runs.size())) return {};
  std::vector<Disturbance> disturbances;
  for (const Stretch& s : found) {
    const MissingTorque& run = left.runs[all[s.begin].run];
    constexpr double per_second = 1000;  // no cut is meant to less
    disturbances.push_back({run.run, std::floor(per_second * run.t[all[s.begin].k]) / per_second,
                            std::ceil(per_second * run.t[all[s.end - 1].k]) / per_second, mean_off(s, all)});
  }
  return disturbances;
}

namespace {

/// Between the name of a run and the span that a piece of it is.
constexpr std::string_view first_span = "@", another_span = ", ";

}  // namespace

bool is_of_disturbed_run(std::string_view name, const Disturbance& d) {
  if (!name.starts_with(d.run)) return false;
  const std::string_view rest = name.substr(d.run.size());
  return rest.empty() || rest.starts_with(first_span) || rest.starts_with(another_span);
}

std::vector<Run> without_disturbances(std::span<const Run> runs, std::span<const Disturbance> disturbances,
                                      Signal input) {
  constexpr double least = 0.1;
  constexpr std::size_t fewest = 50;
  std::vector<Run> all;
  for (const Run& run : runs) {
    std::vector<Disturbance> own;
    for (const Disturbance& d : disturbances) {
      if (d.run == run.name) own.push_back(d);
    }
    if (own.empty()) {
      all.push_back(run);
      continue;
    }
    std::ranges::sort(own, {}, &Disturbance::from_s);
    const auto keep = [&](double from, double to) {
      if (std::min(to, run.duration()) - from < least * run.duration()) return;
      Run piece = cut(run, from, to);
      if (!piece.has(input) || piece.at(input).t.size() < fewest) return;
      const bool named_span = run.name.find('@') != std::string::npos;
      piece.name = run.name + std::string(named_span ? another_span : first_span) + (from > 0 ? shortest(from) : "") +
                   ":" + (std::isfinite(to) ? shortest(to) : "");
      all.push_back(std::move(piece));
    };
    double from = 0;
    for (const Disturbance& d : own) {
      keep(from, d.from_s);
      from = d.to_s;
    }
    keep(from, HUGE_VAL);
  }
  return all;
}

}  // namespace emtb
