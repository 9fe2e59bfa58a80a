#include "report/discovery_figures.h"

#include <algorithm>
#include <cmath>

#include "analysis/discover/samples.h"
#include "report/discovery_words.h"
#include "report/figures_of_diagnosis.h"
#include "report/symbols.h"

namespace emtb {
namespace {

/// The mean of what is missing in even bins over a quantity, with its scatter.
struct Binned {
  std::vector<double> at, value, low, high;
};

Binned binned(const Discovery& d, const Law& law) {
  constexpr std::size_t count = 30, fewest = 5;
  const double low = law.at.front(), width = (law.at.back() - low) / count;
  std::vector<double> sum(count, 0.0), squares(count, 0.0), n(count, 0.0);
  for (const MissingTorque& run : d.left.runs) {
    const std::vector<double>& x = states_over(run, law.text.of.front());
    const std::vector<double>& y = law.text.place == TermPlace::voltage ? run.voltage : run.torque;
    for (std::size_t k = 0; k < x.size(); ++k) {
      const double turn = law.text.of.front() == "theta" ? x[k] - 2 * M_PI * std::floor(x[k] / (2 * M_PI)) : x[k];
      const auto bin = static_cast<std::size_t>(std::clamp((turn - low) / width, 0.0, count - 1.0));
      sum[bin] += y[k], squares[bin] += y[k] * y[k], n[bin] += 1;
    }
  }
  Binned b;
  for (std::size_t k = 0; k < count; ++k) {
    if (n[k] < fewest) continue;
    const double mean = sum[k] / n[k], scatter = std::sqrt(std::max(0.0, squares[k] / n[k] - mean * mean));
    b.at.push_back(low + (static_cast<double>(k) + 0.5) * width);
    b.value.push_back(mean);
    b.low.push_back(mean - scatter);
    b.high.push_back(mean + scatter);
  }
  return b;
}

}  // namespace

std::optional<NamedFigure> law_figure(const Discovery& d) {
  if (!d.law || !(d.law->at.back() > d.law->at.front())) return {};
  const Law& law = *d.law;
  const std::string& of = law.text.of.front();
  const bool factor = law.text.place == TermPlace::flux;
  const std::string unit = law.text.place == TermPlace::torque ? "N m" : factor ? "" : "V";
  Figure figure("A law of what is left", "The missing " + name_of(law.text.place) + " over " + of + ", and the law");
  figure.x({symbol_of(of), unit_over(of)});
  Panel& panel = figure.panel({name_of(law.text.place), unit}, 260);
  if (!factor) {
    const Binned b = binned(d, law);
    panel.points_with_errors("missing, mean and scatter", b.at, b.value, b.low, b.high, {Ink::grey});
  }
  std::vector<double> low, high;
  for (std::size_t k = 0; k < law.value.size(); ++k) {
    const double half = k < law.value_error.size() ? normal_95 * law.value_error[k] : 0;
    low.push_back(law.value[k] - half);
    high.push_back(law.value[k] + half);
  }
  const bool remembers = !law.text.rate.empty();
  const std::string line = remembers ? "law, once it lasts" : "law";
  panel.band(line + ", 95 %", law.at, low, high, {Ink::sky}).line(line, law.at, law.value, {Ink::blue});
  return NamedFigure{"law", figure,
                     "`" + law.text.in_words() +
                         "` over what the fitted model lacks. Straight lines in speed, current and "
                         "acceleration are the base parameters' own: the points lack what those took." +
                         (remembers ? " The law remembers: the line is what it comes to where a state lasts, and the "
                                      "points, in motion, are not there yet."
                                    : "")};
}

Figure trend_figure(const std::vector<Trend>& trends) {
  Figure figure("Parameters from session to session", "Each parameter with its 95 % interval, and the line through it");
  std::vector<std::string> names;
  for (const Trend& t : trends) {
    for (const TrendPoint& p : t.points) {
      if (std::ranges::find(names, p.run) == names.end()) names.push_back(p.run);
    }
  }
  const bool few = names.size() <= 12;
  Axis x{few ? "session" : "session, by its number"};
  if (few) x.categories = names;
  figure.x(x);
  for (const Trend& t : trends) {
    std::vector<double> at, value, low, high, line, line_low, line_high;
    for (const TrendPoint& p : t.points) {
      at.push_back(static_cast<double>(std::ranges::find(names, p.run) - names.begin()));
      value.push_back(p.value);
      low.push_back(p.value - normal_95 * p.std_error);
      high.push_back(p.value + normal_95 * p.std_error);
      line.push_back(p.line);
      line_low.push_back(p.line - normal_95 * p.line_error);
      line_high.push_back(p.line + normal_95 * p.line_error);
    }
    if (at.empty()) continue;
    Panel& panel = figure.panel({symbol_of(t.parameter), t.unit}, 130);
    if (at.size() >= 3) {
      panel.band(t.clear ? "trend, 95 %" : "line, 95 %", at, line_low, line_high, {Ink::sky});
      panel.line(t.clear ? "trend" : "no clear trend", at, line, {t.clear ? Ink::vermilion : Ink::grey});
    }
    panel.points_with_errors("", at, value, low, high, {Ink::blue});
  }
  return figure;
}

void tell(Page& page, const Discovery& d) {
  page.section("What no library holds");
  for (const std::string& line : shares_in_words(d)) page.paragraph(line);
  if (d.law) {
    page.lead(law_in_words(*d.law).front() + ".");
    if (const auto figure = law_figure(d)) page.figure(*figure);
    page.list(law_in_words(*d.law));
    page.folded("The law as a candidate, for --candidates", d.law->text.yaml());
    if (const std::string next = next_for_discovery(d); !next.empty()) page.paragraph(next + ".");
  } else {
    page.paragraph("There is " + no_law_in_words(d) + ".");
  }
  const std::vector<std::string> machine = machine_in_words(d);
  page.paragraph(machine.empty() ? "No run is of another machine, and none was disturbed, as far as these runs tell."
                                 : "Not all of the runs are alike:");
  if (!machine.empty()) page.list(machine);
  if (const std::string both = with_and_without(d); !both.empty())
    page.paragraph("The disturbed stretches were " + both + ".");
}

}  // namespace emtb
