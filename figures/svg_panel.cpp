#include "figures/svg_panel.h"

#include <algorithm>
#include <cmath>

namespace emtb::svg {
namespace {

constexpr double band_opacity = 0.2;

bool is_bars(const Trace& t) { return t.kind == Trace::Kind::bars || t.kind == Trace::Kind::horizontal_bars; }

/// Places labels of a given height so that they do not overlap, each as near to where it belongs as can be.
void spread(std::vector<double>& places, double low, double high) {
  std::vector<std::size_t> order(places.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::sort(order, {}, [&](std::size_t i) { return places[i]; });
  double below = low;
  for (const std::size_t i : order) {
    places[i] = std::max(places[i], below);
    below = places[i] + line_height - 3;
  }
  double above = high;
  for (auto i = order.rbegin(); i != order.rend(); ++i) {
    places[*i] = std::min(places[*i], above);
    above = places[*i] - (line_height - 3);
  }
}

/// One panel on its way to SVG.
class PanelDrawing {
 public:
  PanelDrawing(Canvas& canvas, const Layout& layout, std::size_t panel, double top)
      : canvas_(canvas),
        layout_(layout),
        i_(panel),
        panel_(layout.figure().panels[panel]),
        y_(layout.y(panel)),
        top_(top),
        left_(layout.left()),
        width_(layout.width()),
        height_(panel_.height),
        sets_(static_cast<std::size_t>(std::ranges::count_if(panel_.traces, is_bars))) {}

  void draw() {
    head();
    shades();
    axes();
    data();
    words_beside_the_data();
  }

 private:
  double x_of(double value) const { return layout_.x_of(value); }

  /// [px] from the top of the panel; where y is an axis of names, the first is the uppermost.
  double place_of(double value) const {
    const double y = height_ * (1 - y_.share(value));
    return panel_.y_axis.categories.empty() ? y : height_ - y;
  }

  void head() {
    const double first = top_ - layout_.head_height(i_) + text_size + 1;
    if (!y_.title().empty()) canvas_.text(edge, first, y_.title(), {.bold = true});
    for (const Layout::Entry& e : layout_.legend(i_)) {
      const double x = e.x, y = first + e.y;
      for (const Trace& t : panel_.traces)  // a line and its points share a name
        if (t.name == e.trace->name && t.pen.ink == e.trace->pen.ink) sample(t, x, y - 4);
      canvas_.text(x + legend_sample + 6, y, e.trace->name, {});
    }
  }

  void sample(const Trace& t, double x, double y) {
    switch (t.kind) {
      case Trace::Kind::line:
      case Trace::Kind::steps:
        return canvas_.line(x, y, x + legend_sample, y, colour_of(t.pen.ink), std::max(1.5, t.pen.width),
                            dashes(t.pen));
      case Trace::Kind::points:
        if (!t.left.empty() || !t.low.empty())
          canvas_.line(x + 3, y, x + legend_sample - 3, y, colour_of(t.pen.ink), t.pen.width);
        return canvas_.marker(x + legend_sample / 2, y, t.pen);
      case Trace::Kind::band:
        return canvas_.rectangle(x, y - 5, legend_sample, 10, colour_of(t.pen.ink), band_opacity);
      case Trace::Kind::bars:
      case Trace::Kind::horizontal_bars:
        return canvas_.rectangle(x + 5, y - 5, 12, 10, colour_of(t.pen.ink), 0.9);
    }
  }

  void shades() {
    for (const Shade& s : panel_.shades) {
      const double a = std::clamp(x_of(s.from), 0.0, width_), b = std::clamp(x_of(s.to), 0.0, width_);
      canvas_.rectangle(left_ + a, top_, b - a, height_, shadow);
      for (const double end : {a, b}) canvas_.line(left_ + end, top_, left_ + end, top_ + height_, frame, 0.7);
    }
  }

  void axes() {
    const bool names = !panel_.y_axis.categories.empty();
    for (const Tick& tick : y_.ticks()) {
      const double y = top_ + place_of(tick.at);
      if (!names && !tick.label.empty()) canvas_.line(left_, y, left_ + width_, y, grid);
      if (!names) canvas_.line(left_ - (tick.label.empty() ? tick_length / 2 : tick_length), y, left_, y, frame);
      if (tick.label.empty()) continue;
      canvas_.text(left_ - tick_length - 4, y + 4, tick.label, {.colour = &faint_words, .anchor = "end"});
    }
    const bool places = !layout_.figure().x_axis.categories.empty();
    for (const Tick& tick : layout_.x().ticks()) {
      const double x = left_ + x_of(tick.at);
      if (!places && !tick.label.empty()) canvas_.line(x, top_, x, top_ + height_, grid);
      canvas_.line(x, top_ + height_, x, top_ + height_ + (tick.label.empty() ? tick_length / 2 : tick_length), frame);
    }
    canvas_.line(left_, top_, left_, top_ + height_, frame);
    canvas_.line(left_, top_ + height_, left_ + width_, top_ + height_, frame);
  }

  /// What is drawn of the data is cut off at the frame.
  void data() {
    canvas_.raw("<svg x=\"" + px(left_) + "\" y=\"" + px(top_) + "\" width=\"" + px(width_) + "\" height=\"" +
                px(height_) + "\">\n");
    for (const Trace& t : panel_.traces)
      if (t.kind == Trace::Kind::band) band(t);
    references();
    traces();
    for (const Trace& t : panel_.traces)
      if (t.kind == Trace::Kind::band) band_edges(t);
    canvas_.raw("</svg>\n");
  }

  void references() {
    for (const Reference& r : panel_.references) {
      if (r.vertical) {
        canvas_.line(x_of(r.at), 0, x_of(r.at), height_, colour_of(r.pen.ink), r.pen.width, dashes(r.pen));
      } else {
        canvas_.line(0, place_of(r.at), width_, place_of(r.at), colour_of(r.pen.ink), r.pen.width, dashes(r.pen));
      }
    }
  }

  void traces() {
    const double zero = y_.share(0) > 0 && y_.share(0) < 1 ? place_of(0) : height_;
    std::size_t set = 0;
    for (const Trace& t : panel_.traces) {
      switch (t.kind) {
        case Trace::Kind::band:
          break;
        case Trace::Kind::line:
        case Trace::Kind::steps:
          canvas_.curve(curve(t), t.pen);
          break;
        case Trace::Kind::points:
          points(t);
          break;
        case Trace::Kind::bars:
          bars(t, set++, zero);
          break;
        case Trace::Kind::horizontal_bars:
          horizontal_bars(t, set++);
          break;
      }
    }
  }

  void words_beside_the_data() {
    std::size_t set = 0;
    for (const Trace& t : panel_.traces) {
      data_labels(t, set);
      set += is_bars(t);
    }
    for (const Shade& s : panel_.shades) {
      if (s.label.empty()) continue;
      const double a = std::clamp(x_of(s.from), 0.0, width_), b = std::clamp(x_of(s.to), 0.0, width_);
      canvas_.text(left_ + 0.5 * (a + b), top_ - 4, s.label,
                   {.colour = &faint_words, .anchor = "middle", .halo = true});
    }
    for (const Reference& r : panel_.references) {
      if (!r.label.empty()) reference_label(r);
    }
    for (const Note& n : panel_.notes) {
      const double x = x_of(n.x);
      const bool right = x > 0.6 * width_;
      canvas_.text(left_ + x, top_ + std::clamp(place_of(n.y), 12.0, height_ - 4), n.text,
                   {.anchor = right ? "end" : "start", .halo = true});
    }
    if (layout_.named_at_ends(i_)) names_at_ends();
  }

  void reference_label(const Reference& r) {
    if (r.vertical) {
      const double x = x_of(r.at);
      const bool left_of_it = x + 6 + width_of(r.label) > width_;
      canvas_.text(left_ + x + (left_of_it ? -5 : 5), top_ + 12, r.label,
                   {.colour = &faint_words, .anchor = left_of_it ? "end" : "start", .halo = true});
    } else {
      const double y = place_of(r.at);
      canvas_.text(left_ + width_ - 4, top_ + (y < 16 ? y + 13 : y - 4), r.label,
                   {.colour = &faint_words, .anchor = "end", .halo = true});
    }
  }

  void names_at_ends() {
    const std::vector<const Trace*> list = layout_.named(i_);
    std::vector<double> ends(list.size());
    std::ranges::transform(list, ends.begin(), [&](const Trace* t) { return place_of(t->y.back()); });
    spread(ends, 0, height_);
    for (std::size_t k = 0; k < list.size(); ++k) {
      canvas_.text(left_ + width_ + 6, top_ + ends[k] + 4, list[k]->name, {.colour = &colour_of(list[k]->pen.ink)});
    }
  }

  Pixels curve(const Trace& t) const {
    Pixels p;
    for (std::size_t k = 0; k < t.x.size(); ++k) {
      if (t.kind == Trace::Kind::steps && k > 0) {
        p.x.push_back(x_of(t.x[k]));
        p.y.push_back(p.y.back());
      }
      p.x.push_back(x_of(t.x[k]));
      p.y.push_back(place_of(t.y[k]));
    }
    return thinned(p.x, p.y);
  }

  /// Piece by piece between gaps.
  void band(const Trace& t) {
    Pixels above, below;
    const auto flush = [&] {
      canvas_.area(thinned(above.x, above.y), thinned(below.x, below.y), colour_of(t.pen.ink), band_opacity);
      above = below = {};
    };
    for (std::size_t k = 0; k < t.x.size(); ++k) {
      const double place = x_of(t.x[k]), high = place_of(t.high[k]), low = place_of(t.low[k]);
      if (!std::isfinite(place) || !std::isfinite(high) || !std::isfinite(low)) {
        flush();
        continue;
      }
      above.x.push_back(place), above.y.push_back(high);
      below.x.push_back(place), below.y.push_back(low);
    }
    flush();
  }

  /// Drawn above the data, which may hide the band.
  void band_edges(const Trace& t) {
    for (const std::vector<double>* edge_of : {&t.low, &t.high}) {
      Trace line = t;
      line.kind = Trace::Kind::line;
      line.y = *edge_of;
      canvas_.curve(curve(line), {t.pen.ink, 0.7, Dash::solid});
    }
  }

  void points(const Trace& t) {
    std::vector<double> xs, ys;
    for (std::size_t k = 0; k < t.x.size(); ++k) {
      xs.push_back(x_of(t.x[k]));
      ys.push_back(place_of(t.y[k]));
    }
    const bool many = xs.size() > 3 * static_cast<std::size_t>(width_);
    if (many) {  // a cloud: two of each pixel column, its ends, tell its shape
      const Pixels p = thinned(xs, ys);
      xs = p.x, ys = p.y;
    }
    for (std::size_t k = 0; k < xs.size(); ++k) {
      if (!std::isfinite(xs[k]) || !std::isfinite(ys[k])) continue;
      if (!many) error_bars(t, k, xs[k], ys[k]);
      canvas_.marker(xs[k], ys[k], t.pen);
    }
  }

  void error_bars(const Trace& t, std::size_t k, double x, double y) {
    if (!t.low.empty()) {
      const double a = place_of(t.low[k]), b = place_of(t.high[k]);
      if (std::isfinite(a) && std::isfinite(b)) {
        canvas_.line(x, a, x, b, colour_of(t.pen.ink), t.pen.width);
        for (const double end : {a, b}) canvas_.line(x - 3, end, x + 3, end, colour_of(t.pen.ink), t.pen.width);
      }
    }
    if (!t.left.empty()) {
      const double a = std::clamp(x_of(t.left[k]), -9.0, width_ + 9),
                   b = std::clamp(x_of(t.right[k]), -9.0, width_ + 9);
      canvas_.line(a, y, b, y, colour_of(t.pen.ink), t.pen.width);
      for (const double end : {a, b}) canvas_.line(end, y - 4, end, y + 4, colour_of(t.pen.ink), t.pen.width);
    }
  }

  /// How wide a bar is: four fifths of the room from place to place, shared by the sets.
  double bar_width(const Trace& t, double pixels_a_unit) const {
    std::vector<double> places = t.kind == Trace::Kind::bars ? t.x : t.y;
    std::ranges::sort(places);
    double distance = 1e300;
    for (std::size_t k = 1; k < places.size(); ++k)
      if (places[k] > places[k - 1]) distance = std::min(distance, places[k] - places[k - 1]);
    if (distance > 1e299) distance = 1;
    return std::clamp(0.8 * distance * pixels_a_unit / static_cast<double>(sets_), 1.0, 64.0);
  }

  double offset(double width, std::size_t set) const {
    return width * (static_cast<double>(set) - 0.5 * static_cast<double>(sets_));
  }

  void bars(const Trace& t, std::size_t set, double zero) {
    const double width = bar_width(t, width_ / (layout_.x().range().high - layout_.x().range().low));
    for (std::size_t k = 0; k < t.x.size(); ++k) {
      const double y = place_of(t.y[k]);
      if (!std::isfinite(y)) continue;
      canvas_.rectangle(x_of(t.x[k]) + offset(width, set), std::min(y, zero), width - 1,
                        std::max(1.0, std::abs(y - zero)), colour_of(t.pen.ink), 0.9);
    }
  }

  void horizontal_bars(const Trace& t, std::size_t set) {
    const double height = bar_height(t);
    const double zero = layout_.x().share(0) > 0 ? x_of(0) : 0;
    for (std::size_t k = 0; k < t.x.size(); ++k) {
      const double x = x_of(t.x[k]);
      if (!std::isfinite(x)) continue;
      canvas_.rectangle(std::min(x, zero), place_of(t.y[k]) + offset(height, set), std::max(1.0, std::abs(x - zero)),
                        height - 1, colour_of(t.pen.ink), 0.9);
    }
  }

  double bar_height(const Trace& t) const {
    const double pixels = std::abs(place_of(1) - place_of(0));
    return std::min(20.0, bar_width(t, std::isfinite(pixels) ? pixels : 1 / (y_.range().high - y_.range().low)));
  }

  void data_labels(const Trace& t, std::size_t set) {
    for (std::size_t k = 0; k < t.labels.size(); ++k) {
      double x = x_of(t.x[k]), y = place_of(t.y[k]);
      if (t.labels[k].empty() || !std::isfinite(y)) continue;
      if (t.kind == Trace::Kind::horizontal_bars) {
        const double height = bar_height(t);
        if (!std::isfinite(x)) x = 0;
        x = std::max({x, layout_.x().share(0) > 0 ? x_of(0) : 0.0, 0.0});
        canvas_.text(left_ + x + 6, top_ + y + offset(height, set) + height / 2 + 4, t.labels[k], {.halo = true});
        continue;
      }
      if (t.kind == Trace::Kind::bars) {
        const double width = bar_width(t, width_ / (layout_.x().range().high - layout_.x().range().low));
        x += offset(width, set) + width / 2;
      }
      canvas_.text(left_ + std::clamp(x, 0.5 * width_of(t.labels[k]) - left_ + 2, width_), top_ + std::max(8.0, y - 7),
                   t.labels[k], {.anchor = "middle", .halo = true});
    }
  }

  Canvas& canvas_;
  const Layout& layout_;
  std::size_t i_;
  const Panel& panel_;
  const Scale& y_;
  double top_, left_, width_, height_;
  std::size_t sets_;  ///< bars that stand beside each other at the same place
};

}  // namespace

void draw_panel(Canvas& canvas, const Layout& layout, std::size_t panel, double top) {
  PanelDrawing(canvas, layout, panel, top).draw();
}

}  // namespace emtb::svg
