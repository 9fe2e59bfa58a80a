#include "paper/estimate_figure.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>

namespace emtb {
namespace {

std::string equation(const LineFit& line) {
  char text[80];
  std::snprintf(text, sizeof text, "y = %.4gx %s %.4g", line.slope, line.intercept < 0 ? "-" : "+",
                line.intercept < 0 ? -line.intercept : line.intercept);
  return text;
}

/// `R_a` as `R_{a}`, which a figure sets as a subscript.
std::string with_subscripts(const std::string& text) {
  std::string out;
  for (std::size_t at = 0; at < text.size(); ++at) {
    out += text[at];
    if (text[at] != '_') continue;
    out += '{';
    while (at + 1 < text.size() && std::isalnum(static_cast<unsigned char>(text[at + 1]))) out += text[++at];
    out += '}';
  }
  return out;
}

/// Runs are called after their files: the last part of the path says which.
std::string last_part(const std::string& name) { return name.substr(name.rfind('/') + 1); }

}  // namespace

bool has_points(const StaticEstimate& estimate) {
  return std::ranges::any_of(estimate.series, [](const EstimateSeries& s) { return !s.x.empty(); });
}

Figure figure_of(const StaticEstimate& estimate) {
  static constexpr std::array inks{Ink::blue, Ink::vermilion, Ink::green, Ink::purple, Ink::orange, Ink::sky};
  Figure figure(with_subscripts(estimate.title), estimate.title + ": " + std::to_string(estimate.points) + " points");
  figure.x({estimate.x_label, estimate.x_unit});
  Panel& panel = figure.panel({estimate.y_label, estimate.y_unit}, 300);
  double low = 0, high = 0;
  std::size_t n = 0;
  for (const EstimateSeries& s : estimate.series) {
    if (s.x.empty()) continue;
    const auto [least, most] = std::ranges::minmax(s.x);
    low = std::min(low, least);
    high = std::max(high, most);
    const Pen pen{.ink = inks[n++ % inks.size()]};
    if (s.joined) {
      panel.line(last_part(s.name), s.x, s.y, pen);
    } else if (s.y_error.empty()) {
      panel.points(s.name, s.x, s.y, pen);
    } else {
      std::vector<double> from, to;
      for (std::size_t k = 0; k < s.y.size(); ++k) {
        from.push_back(s.y[k] - s.y_error[k]);
        to.push_back(s.y[k] + s.y_error[k]);
      }
      panel.points_with_errors(s.name, s.x, s.y, std::move(from), std::move(to), pen);
    }
  }
  if (estimate.line) {
    panel.line(equation(*estimate.line), {low, high}, {estimate.line->at(low), estimate.line->at(high)},
               {.ink = Ink::vermilion, .dash = Dash::solid, .marker = Marker::none});
  }
  return figure;
}

}  // namespace emtb
