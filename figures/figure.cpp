#include "figures/figure.h"

#include <cassert>
#include <utility>

namespace emtb {
namespace {

Trace trace(Trace::Kind kind, std::string&& name, std::vector<double>&& x, std::vector<double>&& y, const Pen& pen) {
  assert(x.size() == y.size());
  Trace t;
  t.kind = kind;
  t.name = std::move(name);
  t.x = std::move(x);
  t.y = std::move(y);
  t.pen = pen;
  return t;
}

}  // namespace

Panel& Panel::line(std::string name, std::vector<double> x, std::vector<double> y, Pen pen) {
  traces.push_back(trace(Trace::Kind::line, std::move(name), std::move(x), std::move(y), pen));
  return *this;
}

Panel& Panel::steps(std::string name, std::vector<double> x, std::vector<double> y, Pen pen) {
  traces.push_back(trace(Trace::Kind::steps, std::move(name), std::move(x), std::move(y), pen));
  return *this;
}

Panel& Panel::points(std::string name, std::vector<double> x, std::vector<double> y, Pen pen) {
  traces.push_back(trace(Trace::Kind::points, std::move(name), std::move(x), std::move(y), pen));
  return *this;
}

Panel& Panel::points_with_errors(std::string name, std::vector<double> x, std::vector<double> y,
                                 std::vector<double> low, std::vector<double> high, Pen pen) {
  assert(low.size() == x.size() && high.size() == x.size());
  points(std::move(name), std::move(x), std::move(y), pen);
  traces.back().low = std::move(low);
  traces.back().high = std::move(high);
  return *this;
}

Panel& Panel::intervals(std::string name, std::vector<double> x, std::vector<double> y, std::vector<double> left,
                        std::vector<double> right, Pen pen) {
  assert(left.size() == x.size() && right.size() == x.size());
  points(std::move(name), std::move(x), std::move(y), pen);
  traces.back().left = std::move(left);
  traces.back().right = std::move(right);
  return *this;
}

Panel& Panel::band(std::string name, std::vector<double> x, std::vector<double> low, std::vector<double> high,
                   Pen pen) {
  assert(low.size() == x.size() && high.size() == x.size());
  std::vector<double> middle(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) middle[i] = 0.5 * (low[i] + high[i]);
  traces.push_back(trace(Trace::Kind::band, std::move(name), std::move(x), std::move(middle), pen));
  traces.back().low = std::move(low);
  traces.back().high = std::move(high);
  return *this;
}

Panel& Panel::bars(std::string name, std::vector<double> x, std::vector<double> y, Pen pen) {
  traces.push_back(trace(Trace::Kind::bars, std::move(name), std::move(x), std::move(y), pen));
  return *this;
}

Panel& Panel::horizontal_bars(std::string name, std::vector<double> x, std::vector<double> y, Pen pen) {
  traces.push_back(trace(Trace::Kind::horizontal_bars, std::move(name), std::move(x), std::move(y), pen));
  return *this;
}

Panel& Panel::labels(std::vector<std::string> of_the_last_trace) {
  assert(!traces.empty() && traces.back().x.size() == of_the_last_trace.size());
  traces.back().labels = std::move(of_the_last_trace);
  return *this;
}

Panel& Panel::reference(double y, std::string label, Pen pen) {
  references.push_back({y, std::move(label), false, pen});
  return *this;
}

Panel& Panel::vertical_reference(double x, std::string label, Pen pen) {
  references.push_back({x, std::move(label), true, pen});
  return *this;
}

Panel& Panel::shade(double from, double to, std::string label) {
  shades.push_back({from, to, std::move(label)});
  return *this;
}

Panel& Panel::note(double x, double y, std::string text) {
  notes.push_back({x, y, std::move(text)});
  return *this;
}

Figure& Figure::x(Axis axis) {
  x_axis = std::move(axis);
  return *this;
}

Figure& Figure::wide(double pixels) {
  width = pixels;
  return *this;
}

Panel& Figure::panel(Axis y, double height) { return panels.emplace_back(std::move(y), height); }

}  // namespace emtb
