#pragma once

#include <functional>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "analysis/check/check.h"
#include "tests/analysis/check/planted.h"

/// Every kind of garbage in every signal of a set of runs, and what check() calls it.
namespace emtb::planted {

struct Counts {
  int planted = 0, named = 0, beside = 0;
  std::map<std::string, int> missed;

  void add(const Counts& more) {
    planted += more.planted, named += more.named, beside += more.beside;
    for (const auto& [what, n] : more.missed) missed[what] += n;
  }
  std::string text() const {
    std::string all = std::to_string(named) + " of " + std::to_string(planted) + " named, " + std::to_string(beside) +
                      " findings beside";
    for (const auto& [what, n] : missed) all += "; missed " + std::to_string(n) + " of " + what;
    return all;
  }
};

class Sweep {
 public:
  Sweep(std::string name, std::vector<Run> runs, const Model* model)
      : name_(std::move(name)), runs_(std::move(runs)), model_(model), healthy_(check(runs_, {}, model)) {}

  const DataFindings& healthy() const { return healthy_; }
  const Counts& counts() const { return counts_; }

  /// @param what any of these is right @param signal any, where there is none
  /// @param damage of the runs; false: cannot be done here
  void plant(const std::string& kind, std::vector<Flaw> what, std::optional<Signal> signal,
             const std::function<bool(std::vector<Run>&)>& damage, std::size_t held_out = 0) {
    std::vector<Run> runs = runs_;
    if (!damage(runs)) return;
    const std::span<const Run> all = runs;
    const DataFindings found = check(all.first(all.size() - held_out), all.last(held_out), model_);
    const auto same = [](const DataFinding& a, const DataFinding& b) {
      return a.what == b.what && a.signal == b.signal && a.stops == b.stops;
    };
    bool named = false;
    std::string beside;
    for (const DataFinding& f : found) {
      const bool right = std::ranges::find(what, f.what) != what.end();
      named = named || (right && (!signal || f.signal == signal));
      if (right || std::ranges::any_of(healthy_, [&](const DataFinding& h) { return same(f, h); })) continue;
      if (f.what == Flaw::scale && !f.stops) continue;  // the remark that nothing fixes it
      beside += " " + std::string(name_of(f.what)) + (f.signal ? ":" + std::string(info(*f.signal).name) : "");
    }
    const std::string label = kind + (signal ? " " + std::string(info(*signal).name) : "");
    ++counts_.planted;
    counts_.named += named ? 1 : 0;
    counts_.beside += beside.empty() ? 0 : 1;
    if (!named) ++counts_.missed[label];
    if (!named || !beside.empty())
      std::cout << name_ << ": " << label << (named ? " named" : " MISSED") << ", beside:" << beside << "\n";
  }

  /// What can happen to any recording, in a signal that is a sensor's.
  void plant_in_signal(Signal s, bool with_sign) {
    const auto one = [&](const auto& damage) {  // in the run in which the signal moves most
      return [=, this](std::vector<Run>& runs) {
        Run* most = nullptr;
        for (Run& run : runs) {
          if (run.has(s) && !is_sparse(run, s) && (!most || top(run, s) > top(*most, s))) most = &run;
        }
        return most && top(*most, s) > 0 && damage(*most);
      };
    };
    if (with_sign) {
      plant("sign", {Flaw::sign}, s, [=](std::vector<Run>& runs) {
        for (Run& run : runs) scale(run, s, -1);
        return true;
      });
    }
    plant("spikes", {Flaw::spikes}, s, one([=](Run& run) {
            spike(run, s, 5, 3);
            return true;
          }));
    plant("held", {Flaw::held}, s,
          one([=](Run& run) { return hold(run, s, std::max<std::size_t>(30, run.at(s).t.size() / 20)); }));
    if (s == Signal::theta) return;
    plant("clipped", {Flaw::clipped}, s, one([=](Run& run) {
            clip(run, s, 0.6);
            return true;
          }));
  }

  /// One run whose signal has another unit than in the others.
  void plant_other_scale(Signal s, double factor) {
    plant("other scale", {Flaw::scale}, s, [=](std::vector<Run>& runs) {
      if (runs.size() < 2 || !runs.back().has(s)) return false;
      scale(runs.back(), s, factor);
      return true;
    });
  }

  void plant_in_rows() {
    const auto middle = [](const Run& run) { return 0.5 * run.duration(); };
    plant("gap", {Flaw::gap}, {}, [&](std::vector<Run>& runs) {
      const double h = runs[0].duration() / static_cast<double>(runs[0].signals.begin()->second.t.size());
      hole(runs[0], middle(runs[0]), middle(runs[0]) + std::max(0.3, 30 * h));
      return true;
    });
    plant("gap of 100 s", {Flaw::gap}, {}, [&](std::vector<Run>& runs) {
      pause(runs[0], middle(runs[0]), 100);
      return true;
    });
    plant("twice", {Flaw::duplicate}, {}, [](std::vector<Run>& runs) {
      runs.push_back(runs.back());
      runs.back().name += " again";
      return true;
    });
    plant(
        "held out", {Flaw::duplicate}, {},
        [](std::vector<Run>& runs) {
          runs.push_back(runs.back());
          return true;
        },
        1);
    plant("jitter", {Flaw::jitter}, {}, [](std::vector<Run>& runs) {
      const Signal rows = runs[0].has(Signal::u_ref) ? Signal::u_ref
                          : runs[0].has(Signal::e_a) ? Signal::e_a
                                                     : Signal::i_a;
      jitter(runs[0], rows, 1, 5);
      return true;
    });
  }

 private:
  std::string name_;
  std::vector<Run> runs_;
  const Model* model_;
  DataFindings healthy_;
  Counts counts_;
};

}  // namespace emtb::planted
