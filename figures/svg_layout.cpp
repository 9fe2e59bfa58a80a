#include "figures/svg_layout.h"

#include <algorithm>
#include <cmath>

#include "figures/svg_canvas.h"

namespace emtb::svg {
namespace {

bool has_curve(const Trace& t) { return t.kind == Trace::Kind::line || t.kind == Trace::Kind::steps; }

bool any_trace(const Figure& figure, const auto& is_so) {
  return std::ranges::any_of(figure.panels, [&](const Panel& p) { return std::ranges::any_of(p.traces, is_so); });
}

/// Words in lines. @param room [px] of a line, in the size of all text
std::vector<std::string> wrapped_to(const std::string& text, double room) {
  std::vector<std::string> lines{""};
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t end = std::min(text.find(' ', i), text.size());
    const std::string word = text.substr(i, end - i);
    if (!lines.back().empty() && width_of(lines.back() + " " + word) > room) lines.emplace_back();
    lines.back() += (lines.back().empty() ? "" : " ") + word;
    i = end + 1;
  }
  return lines;
}

}  // namespace

Layout::Layout(const Figure& figure) : figure_(figure) {
  find_y();  // first, since the width of its labels is what is left of x
  find_sides();
  find_x();
  find_heights();
}

void Layout::find_y() {
  double labels = 0;
  for (const Panel& p : figure_.panels) {
    double padding = 0.06;
    for (const Trace& t : p.traces) {
      if (t.kind == Trace::Kind::bars && !t.labels.empty()) padding = 0.1;
      if (t.kind == Trace::Kind::points && !t.labels.empty()) padding = 0.12;
    }
    Axis axis = p.y_axis;
    for (const Trace& t : p.traces) axis.with_zero = axis.with_zero || (t.kind == Trace::Kind::bars && !axis.log);
    y_.emplace_back(axis, y_range(p), padding, p.height / 30);
    for (const Tick& tick : y_.back().ticks()) labels = std::max(labels, width_of(tick.label));
  }
  left_ = edge + labels + tick_length + 5;
}

void Layout::find_sides() {
  right_ = edge;
  for (std::size_t i = 0; i < figure_.panels.size(); ++i) {
    at_ends_.push_back(ends_apart(i));
    if (!at_ends_.back()) continue;
    for (const Trace* t : named(i)) right_ = std::max(right_, edge + 7 + width_of(t->name));
  }
  width_ = figure_.width - left_ - right_;
}

void Layout::find_x() {
  Axis axis = figure_.x_axis;
  Range range = x_range(figure_);
  if (any_trace(figure_, [](const Trace& t) { return t.kind == Trace::Kind::horizontal_bars && !t.labels.empty(); })) {
    axis.with_zero = axis.with_zero || !axis.log;
    range = with_room_for_labels(range, axis);
  }
  const bool shapes =
      any_trace(figure_, [](const Trace& t) { return t.kind == Trace::Kind::points || t.kind == Trace::Kind::bars; });
  x_.emplace(axis, range, shapes ? 0.03 : 0, width_ / 80);
  if (!x_->ticks().empty() && figure_.x_axis.categories.empty()) {  // half of the last label sticks out
    const double beyond = 0.5 * width_of(x_->ticks().back().label);
    const double free = width_ * (1 - x_->share(x_->ticks().back().at)) + right_ - 4;
    if (beyond > free) right_ += beyond - free, width_ = figure_.width - left_ - right_;
  }
}

/// Room for the words at the ends of horizontal bars.
Range Layout::with_room_for_labels(Range range, const Axis& axis) const {
  double most = 0;
  for (const Panel& p : figure_.panels) {
    for (const Trace& t : p.traces) {
      if (t.kind != Trace::Kind::horizontal_bars) continue;
      for (const std::string& label : t.labels) most = std::max(most, width_of(label));
    }
  }
  const double room = std::min(0.6, (most + 10) / width_);
  if (axis.log) {
    range.high *= std::pow(range.high / range.low, room / (1 - room));
  } else {
    range.high += (range.high - std::min(0.0, range.low)) * room / (1 - room);
  }
  return range;
}

void Layout::find_heights() {
  const double lines = static_cast<double>(title_lines().size());
  top_ = edge + (lines > 0 ? title_size + 8 + (lines - 1) * line_height : 0);
  height_ = top_;
  for (std::size_t i = 0; i < figure_.panels.size(); ++i) {
    heads_.push_back(needed_head(i));
    height_ += heads_.back() + figure_.panels[i].height + gap;
  }
  x_lines_ = 1;
  if (!figure_.x_axis.categories.empty()) {
    for (const std::string& name : figure_.x_axis.categories) x_lines_ = std::max(x_lines_, wrapped(name).size());
  }
  height_ +=
      -gap + tick_length + line_height * static_cast<double>(x_lines_) + (x_->title().empty() ? 0 : line_height) + 6;
}

std::vector<const Trace*> Layout::named(std::size_t panel) const {
  std::vector<const Trace*> list;
  const auto same = [](const Trace& a, const Trace& b) { return a.name == b.name && a.pen.ink == b.pen.ink; };
  for (const Trace& t : figure_.panels[panel].traces) {
    if (t.name.empty()) continue;
    bool shown = false;
    for (std::size_t above = 0; above < panel && !shown; ++above) {
      shown = std::ranges::any_of(figure_.panels[above].traces, [&](const Trace& u) { return same(t, u); });
    }
    shown = shown || std::ranges::any_of(list, [&](const Trace* u) { return same(t, *u); });
    if (!shown) list.push_back(&t);
  }
  return list;
}

/// May the curves of a panel be named at their ends? Where they end at the right and apart from each other.
bool Layout::ends_apart(std::size_t panel) const {
  const Panel& p = figure_.panels[panel];
  const std::vector<const Trace*> list = named(panel);
  if (list.empty() || list.size() > 4 || !figure_.x_axis.categories.empty()) return false;
  const Range x = x_range(figure_);
  std::vector<double> ends;
  for (const Trace* t : list) {
    if (!has_curve(*t) || t->x.size() < 2 || figure_.x_axis.log) return false;
    if (!std::isfinite(t->y.back()) || t->x.back() < x.high - 0.02 * (x.high - x.low)) return false;
    ends.push_back(p.height * y_[panel].share(t->y.back()));
  }
  std::ranges::sort(ends);
  for (std::size_t i = 1; i < ends.size(); ++i)
    if (ends[i] - ends[i - 1] < line_height - 3) return false;
  return list.size() > 1;
}

std::vector<Layout::Entry> Layout::legend(std::size_t panel) const {
  std::vector<Entry> entries;
  if (at_ends_[panel]) return entries;
  const double start = edge + (y_[panel].title().empty() ? 0 : width_of(y_[panel].title()) * 1.06 + 20);
  const double end = figure_.width - edge;
  double x = start, y = 0;
  bool first = start == edge;  // of its line, the words before it counted
  for (const Trace* t : named(panel)) {
    const double own = legend_sample + 6 + width_of(t->name), width = own + 16;
    if (x + own > end && !first) x = start + own <= end ? start : edge, y += line_height;
    first = false;
    entries.push_back({t, x, y});
    x += width;
  }
  return entries;
}

double Layout::needed_head(std::size_t panel) const {
  const std::vector<Entry> entries = legend(panel);
  const bool empty = entries.empty() && y_[panel].title().empty();
  return empty ? 4 : line_height + 5 + (entries.empty() ? 0 : entries.back().y);
}

std::vector<std::string> Layout::title_lines() const {
  if (figure_.title.empty()) return {};
  constexpr double bold = 1.06;
  return wrapped_to(figure_.title, (figure_.width - 2 * edge) * text_size / (title_size * bold));
}

std::vector<std::string> Layout::wrapped(const std::string& name) const {
  return wrapped_to(name, width_ / static_cast<double>(figure_.x_axis.categories.size()) - 6);
}

}  // namespace emtb::svg
