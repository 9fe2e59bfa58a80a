#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>

#include "figures/escape.h"
#include "figures/figure.h"
#include "figures/scale.h"
#include "hal/error.h"

namespace emtb {
namespace {

constexpr double text_size = 12;      // [px]
constexpr double title_size = 14;     // [px]
constexpr double line_height = 17;    // [px]
constexpr double tick_length = 4;     // [px]
constexpr double gap = 12;            // [px] between panels
constexpr double edge = 10;           // [px] around everything
constexpr double legend_sample = 22;  // [px]

constexpr const char* font = "'Helvetica Neue',Helvetica,Arial,'Liberation Sans',sans-serif";

struct Colour {
  const char* name;
  const char* light;
  const char* dark;
};

// Okabe and Ito's, orange and sky a little darker where they lie on white.
constexpr std::array<Colour, 8> inks{{{"grey", "#767676", "#9a9a9a"},
                                      {"vermilion", "#d55e00", "#ff8b45"},
                                      {"blue", "#0072b2", "#4fb0f0"},
                                      {"green", "#009e73", "#35c99b"},
                                      {"orange", "#d08a00", "#f2b33d"},
                                      {"purple", "#b8609a", "#e39ac8"},
                                      {"sky", "#3d9fd8", "#93d2f5"},
                                      {"ink", "#1f1f1f", "#e6e6e6"}}};
constexpr Colour paper{"paper", "#ffffff", "#16181c"};
constexpr Colour words{"words", "#1f1f1f", "#e6e6e6"};
constexpr Colour faint_words{"faint", "#5a5a5a", "#a5a8ad"};
constexpr Colour grid{"grid", "#e4e4e4", "#2d3138"};
constexpr Colour frame{"frame", "#6b6b6b", "#8a8f98"};
constexpr Colour shadow{"shade", "#f0f0ee", "#22252b"};

const Colour& colour_of(Ink ink) { return inks[static_cast<std::size_t>(ink)]; }

const char* dashes(const Pen& pen) {
  static constexpr Dash of_ink[] = {Dash::solid,    Dash::dashed, Dash::solid,  Dash::dash_dot,
                                    Dash::dash_dot, Dash::dotted, Dash::dashed, Dash::solid};
  switch (pen.dash == Dash::of_ink ? of_ink[static_cast<std::size_t>(pen.ink)] : pen.dash) {
    case Dash::dashed:
      return "6 3";
    case Dash::dotted:
      return "1.5 2.5";
    case Dash::dash_dot:
      return "7 2.5 1.5 2.5";
    default:
      return "";
  }
}

Marker marker_of(const Pen& pen) {
  static constexpr Marker of_ink[] = {Marker::circle,  Marker::square,   Marker::circle,  Marker::triangle,
                                      Marker::diamond, Marker::triangle, Marker::diamond, Marker::circle};
  return pen.marker == Marker::of_ink ? of_ink[static_cast<std::size_t>(pen.ink)] : pen.marker;
}

/// A length as short as a tenth of a pixel can be written, the same on every machine.
std::string px(double value) {
  long tenths = std::lround(10 * value);
  std::string text = tenths < 0 ? "-" : "";
  tenths = std::abs(tenths);
  const long whole = tenths / 10, rest = tenths % 10;
  if (whole > 0 || rest == 0) text += std::to_string(whole);
  if (rest > 0) text += "." + std::to_string(rest);
  return text;
}

/// How wide a text is, near enough for Helvetica and its metric equals.
double width_of(const std::string& marked, double size = text_size) {
  const std::string text = plain(marked);
  double ems = 0;
  for (const char c : text) {
    if ((c & 0xC0) == 0x80) continue;  // the rest of a character
    if (std::string_view("iljtfI.,:;'|!()[] ").find(c) != std::string_view::npos) {
      ems += 0.30;
    } else if (std::string_view("mwMW%@").find(c) != std::string_view::npos) {
      ems += 0.86;
    } else if (c >= 'A' && c <= 'Z') {
      ems += 0.70;
    } else {
      ems += 0.57;
    }
  }
  return 1.03 * ems * size;
}

/// Writes elements in the colours of a theme.
class Canvas {
 public:
  explicit Canvas(Theme theme) : theme_(theme) {}

  void raw(const std::string& text) { svg_ += text; }

  void line(double x1, double y1, double x2, double y2, const Colour& colour, double width = 1, const char* dash = "") {
    svg_ += "<path d=\"M" + px(x1) + " " + px(y1) + "L" + px(x2) + " " + px(y2) + "\"" + stroke(colour, width, dash) +
            "/>\n";
  }

  void rectangle(double x, double y, double width, double height, const Colour& colour, double opacity = 1) {
    svg_ += "<rect x=\"" + px(x) + "\" y=\"" + px(y) + "\" width=\"" + px(std::max(0.0, width)) + "\" height=\"" +
            px(std::max(0.0, height)) + "\"" + fill(colour, opacity) + "/>\n";
  }

  struct Font {
    const Colour* colour = &words;
    const char* anchor = "start";
    double size = text_size;
    bool bold = false;
    bool halo = false;  ///< on a rim of paper, to be read over lines
  };

  void text(double x, double y, const std::string& marked, const Font& how) {
    std::string attributes;
    if (std::string_view(how.anchor) != "start") attributes += " text-anchor=\"" + std::string(how.anchor) + "\"";
    if (how.size != text_size) attributes += " font-size=\"" + px(how.size) + "\"";
    if (how.bold) attributes += " font-weight=\"600\"";
    std::string rim;
    if (how.halo) {
      rim = theme_ == Theme::page ? " halo" : "";
      if (theme_ == Theme::standalone)
        attributes += " paint-order=\"stroke\" stroke=\"" + std::string(paper.light) + "\" stroke-width=\"3\"";
    }
    const std::string colour = theme_ == Theme::page ? " class=\"f-" + std::string(how.colour->name) + rim + "\""
                                                     : " fill=\"" + std::string(how.colour->light) + "\"";
    svg_ +=
        "<text x=\"" + px(x) + "\" y=\"" + px(y) + "\"" + colour + attributes + ">" + marked_up(marked) + "</text>\n";
  }

  /// A curve through pixels, broken where they are NaN.
  void curve(const Pixels& p, const Pen& pen) {
    const std::string path = path_of(p);
    if (path.empty()) return;
    svg_ += "<path d=\"" + path + "\"" + stroke(colour_of(pen.ink), pen.width, dashes(pen)) +
            " stroke-linejoin=\"round\"/>\n";
  }

  void area(const Pixels& above, const Pixels& below, const Colour& colour, double opacity) {
    if (above.x.empty()) return;
    Pixels around = above;
    around.x.insert(around.x.end(), below.x.rbegin(), below.x.rend());
    around.y.insert(around.y.end(), below.y.rbegin(), below.y.rend());
    svg_ += "<path d=\"" + path_of(around) + "z\"" + fill(colour, opacity) + "/>\n";
  }

  void marker(double x, double y, const Pen& pen) {
    const double r = pen.size;
    std::string d;
    switch (marker_of(pen)) {
      case Marker::circle:
        svg_ += "<circle cx=\"" + px(x) + "\" cy=\"" + px(y) + "\" r=\"" + px(r) + "\"" + fill(colour_of(pen.ink), 1) +
                "/>\n";
        return;
      case Marker::square:
        return rectangle(x - 0.9 * r, y - 0.9 * r, 1.8 * r, 1.8 * r, colour_of(pen.ink));
      case Marker::triangle:
        d = "M" + px(x) + " " + px(y - 1.2 * r) + "l" + px(1.1 * r) + " " + px(2 * r) + "h" + px(-2.2 * r) + "z";
        break;
      case Marker::diamond:
        d = "M" + px(x) + " " + px(y - 1.3 * r) + "l" + px(1.2 * r) + " " + px(1.3 * r) + "l" + px(-1.2 * r) + " " +
            px(1.3 * r) + "l" + px(-1.2 * r) + " " + px(-1.3 * r) + "z";
        break;
      case Marker::cross:
        svg_ += "<path d=\"M" + px(x - r) + " " + px(y - r) + "l" + px(2 * r) + " " + px(2 * r) + "m" + px(-2 * r) +
                " 0l" + px(2 * r) + " " + px(-2 * r) + "\"" + stroke(colour_of(pen.ink), pen.width, "") + "/>\n";
        return;
      default:
        return;
    }
    svg_ += "<path d=\"" + d + "\"" + fill(colour_of(pen.ink), 1) + "/>\n";
  }

  std::string take() { return std::move(svg_); }

 private:
  std::string stroke(const Colour& colour, double width, const char* dash) const {
    std::string text = theme_ == Theme::page ? " class=\"s-" + std::string(colour.name) + "\""
                                             : " fill=\"none\" stroke=\"" + std::string(colour.light) + "\"";
    if (width != 1) text += " stroke-width=\"" + px(width) + "\"";
    if (*dash != 0) text += " stroke-dasharray=\"" + std::string(dash) + "\"";
    return text;
  }

  std::string fill(const Colour& colour, double opacity) const {
    std::string text = theme_ == Theme::page ? " class=\"f-" + std::string(colour.name) + "\""
                                             : " fill=\"" + std::string(colour.light) + "\"";
    if (opacity < 1) text += " fill-opacity=\"" + px(opacity) + "\"";
    return text;
  }

  /// Steps from point to point in tenths of a pixel: half the size of absolute places, and no error adds up.
  static std::string path_of(const Pixels& p) {
    std::string d;
    long at_x = 0, at_y = 0;
    bool drawing = false;
    for (std::size_t i = 0; i < p.x.size(); ++i) {
      if (!std::isfinite(p.x[i]) || !std::isfinite(p.y[i])) {
        drawing = false;
        continue;
      }
      const double limit = 1e6;  // what lies far outside is cut off anyway
      const long x = std::lround(10 * p.x[i]), y = std::lround(10 * std::clamp(p.y[i], -limit, limit));
      const auto tenths = [](long value) { return px(0.1 * static_cast<double>(value)); };
      if (!drawing) {
        d += "M" + tenths(x) + " " + tenths(y) + "l";
        d += "0 0";  // a point alone is seen too
      } else if (x == at_x && y == at_y) {
        continue;
      } else {
        const std::string dy = tenths(y - at_y);
        d += " " + tenths(x - at_x) + (dy[0] == '-' ? "" : " ") + dy;
      }
      at_x = x, at_y = y;
      drawing = true;
    }
    return d;
  }

  /// Escapes, and sets `_{..}` as subscripts.
  static std::string marked_up(const std::string& text) {
    std::string out;
    for (std::size_t i = 0; i < text.size();) {
      const std::size_t mark = text.find("_{", i);
      const std::size_t end = mark == std::string::npos ? mark : text.find('}', mark);
      if (end == std::string::npos) return out + escaped(text.substr(i));
      out += escaped(text.substr(i, mark - i)) + "<tspan dy=\"2.5\" font-size=\"75%\">" +
             escaped(text.substr(mark + 2, end - mark - 2)) + "</tspan>";
      i = end + 1;
      if (i < text.size()) {  // back to the base line, with the next character
        std::size_t next = i + 1;
        while (next < text.size() && (text[next] & 0xC0) == 0x80) ++next;
        if (text.compare(i, 2, "_{") != 0) {
          // A space on its own, and one at the beginning, some drop: then it is a shift.
          const bool space = text[i] == ' ' && next < text.size();
          if (space) i = next++;
          while (next < text.size() && (text[next] & 0xC0) == 0x80) ++next;
          out += "<tspan dy=\"-2.5\"" + std::string(space ? " dx=\"0.28em\"" : "") + ">" +
                 escaped(text.substr(i, next - i)) + "</tspan>";
          i = next;
        }
      }
    }
    return out;
  }

  Theme theme_;
  std::string svg_;
};

bool has_curve(const Trace& t) { return t.kind == Trace::Kind::line || t.kind == Trace::Kind::steps; }

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

/// A figure on its way to SVG: measures first, then draws.
class Drawing {
 public:
  Drawing(const Figure& figure, Theme theme) : f_(figure), canvas_(theme), theme_(theme) { measure(); }

  std::string draw() {
    double y = top_;
    for (std::size_t i = 0; i < f_.panels.size(); ++i) {
      y += heads_[i];
      panel(i, y);
      y += f_.panels[i].height + gap;
    }
    x_axis(y - gap);
    const std::string body = canvas_.take();
    const std::string size = px(f_.width) + " " + px(height_);
    canvas_.raw("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + size + "\" role=\"img\"");
    if (theme_ == Theme::page) {
      canvas_.raw(" class=\"figure\" style=\"max-width:" + px(f_.width) + "px\"");
    } else {
      canvas_.raw(" width=\"" + px(f_.width) + "\" height=\"" + px(height_) + "\" font-family=\"" + font +
                  "\" font-size=\"" + px(text_size) + "\"");
    }
    canvas_.raw(" aria-label=\"" + escaped(plain(f_.title)) + "\">\n<title>" + escaped(plain(f_.title)) +
                "</title>\n<desc>" + escaped(plain(f_.description)) + "</desc>\n");
    if (theme_ == Theme::standalone) canvas_.rectangle(0, 0, f_.width, height_, paper);
    if (!f_.title.empty()) canvas_.text(edge, edge + title_size, f_.title, {.size = title_size, .bold = true});
    canvas_.raw(body + "</svg>\n");
    return canvas_.take();
  }

 private:
  double x_of(double value) const { return width_ * x_->share(value); }

  /// The panel's traces with a name that neither they nor a panel above have shown in the same ink.
  std::vector<const Trace*> named(std::size_t panel) const {
    std::vector<const Trace*> list;
    const auto same = [](const Trace& a, const Trace& b) { return a.name == b.name && a.pen.ink == b.pen.ink; };
    for (const Trace& t : f_.panels[panel].traces) {
      if (t.name.empty()) continue;
      bool shown = false;
      for (std::size_t above = 0; above < panel && !shown; ++above) {
        shown = std::ranges::any_of(f_.panels[above].traces, [&](const Trace& u) { return same(t, u); });
      }
      shown = shown || std::ranges::any_of(list, [&](const Trace* u) { return same(t, *u); });
      if (!shown) list.push_back(&t);
    }
    return list;
  }

  void measure() {
    const Range x = x_range(f_);
    bool shapes = false, labelled_bars = false;
    for (const Panel& p : f_.panels) {
      for (const Trace& t : p.traces) {
        shapes = shapes || t.kind == Trace::Kind::points || t.kind == Trace::Kind::bars;
        labelled_bars = labelled_bars || (t.kind == Trace::Kind::horizontal_bars && !t.labels.empty());
      }
    }
    // y first, since the width of its labels is what is left of x.
    double labels = 0;
    for (const Panel& p : f_.panels) {
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
    right_ = edge;
    for (std::size_t i = 0; i < f_.panels.size(); ++i) {
      direct_.push_back(ends_apart(i));
      if (!direct_.back()) continue;
      for (const Trace* t : named(i)) right_ = std::max(right_, edge + 7 + width_of(t->name));
    }
    Axis axis = f_.x_axis;
    Range range = x;
    width_ = f_.width - left_ - right_;
    if (labelled_bars) {  // room for the words at the bars' ends
      axis.with_zero = axis.with_zero || !axis.log;
      double most = 0;
      for (const Panel& p : f_.panels) {
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
    }
    x_.emplace(axis, range, shapes ? 0.03 : 0, width_ / 80);
    if (!x_->ticks().empty() && f_.x_axis.categories.empty()) {  // half of the last label sticks out
      const double beyond = 0.5 * width_of(x_->ticks().back().label);
      const double free = width_ * (1 - x_->share(x_->ticks().back().at)) + right_ - 4;
      if (beyond > free) right_ += beyond - free, width_ = f_.width - left_ - right_;
    }
    top_ = edge + (f_.title.empty() ? 0 : title_size + 8);
    height_ = top_;
    for (std::size_t i = 0; i < f_.panels.size(); ++i) {
      heads_.push_back(head_height(i));
      height_ += heads_.back() + f_.panels[i].height + gap;
    }
    x_lines_ = 1;
    if (!f_.x_axis.categories.empty()) {
      for (const std::string& name : f_.x_axis.categories) x_lines_ = std::max(x_lines_, wrapped(name).size());
    }
    height_ +=
        -gap + tick_length + line_height * static_cast<double>(x_lines_) + (x_->title().empty() ? 0 : line_height) + 6;
  }

  /// May the curves of a panel be named at their ends? Where they end at the right and apart from each other.
  bool ends_apart(std::size_t panel) const {
    const Panel& p = f_.panels[panel];
    const std::vector<const Trace*> list = named(panel);
    if (list.empty() || list.size() > 4 || !f_.x_axis.categories.empty()) return false;
    const Range x = x_range(f_);
    std::vector<double> ends;
    for (const Trace* t : list) {
      if (!has_curve(*t) || t->x.size() < 2 || f_.x_axis.log) return false;
      if (!std::isfinite(t->y.back()) || t->x.back() < x.high - 0.02 * (x.high - x.low)) return false;
      ends.push_back(p.height * y_[panel].share(t->y.back()));
    }
    std::ranges::sort(ends);
    for (std::size_t i = 1; i < ends.size(); ++i)
      if (ends[i] - ends[i - 1] < line_height - 3) return false;
    return list.size() > 1;
  }

  /// The words above a panel: what y is, then the legend, in as many lines as it takes.
  struct Entry {
    const Trace* trace;
    double x, y;
  };
  std::vector<Entry> legend(std::size_t panel) const {
    std::vector<Entry> entries;
    if (direct_[panel]) return entries;
    const double start = edge + (y_[panel].title().empty() ? 0 : width_of(y_[panel].title()) * 1.06 + 20);
    const double end = f_.width - edge;
    double x = start, y = 0;
    for (const Trace* t : named(panel)) {
      const double width = legend_sample + 6 + width_of(t->name) + 16;
      if (x + width - 16 > end && x > start) x = std::max(edge, std::min(start, end - width)), y += line_height;
      entries.push_back({t, x, y});
      x += width;
    }
    return entries;
  }

  double head_height(std::size_t panel) const {
    const std::vector<Entry> entries = legend(panel);
    const bool empty = entries.empty() && y_[panel].title().empty();
    return empty ? 4 : line_height + 5 + (entries.empty() ? 0 : entries.back().y);
  }

  void head(std::size_t i, double top) {
    const double first = top - heads_[i] + text_size + 1;
    if (!y_[i].title().empty()) canvas_.text(edge, first, y_[i].title(), {.bold = true});
    for (const Entry& e : legend(i)) {
      const double x = e.x, y = first + e.y;
      for (const Trace& t : f_.panels[i].traces)  // a line and its points share a name
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

  void panel(std::size_t i, double top) {
    const Panel& p = f_.panels[i];
    const Scale& ys = y_[i];
    const double height = p.height;
    const auto y_of = [&](double value) { return height * (1 - ys.share(value)); };
    head(i, top);
    const bool names = !p.y_axis.categories.empty();
    const auto place_of = [&](double value) { return names ? height - y_of(value) : y_of(value); };  // first is upmost

    for (const Shade& s : p.shades) {
      const double a = std::clamp(x_of(s.from), 0.0, width_), b = std::clamp(x_of(s.to), 0.0, width_);
      canvas_.rectangle(left_ + a, top, b - a, height, shadow);
      for (const double end : {a, b}) canvas_.line(left_ + end, top, left_ + end, top + height, frame, 0.7);
    }
    for (const Tick& tick : ys.ticks()) {
      const double y = top + place_of(tick.at);
      if (!names && !tick.label.empty()) canvas_.line(left_, y, left_ + width_, y, grid);
      if (!names) canvas_.line(left_ - (tick.label.empty() ? tick_length / 2 : tick_length), y, left_, y, frame);
      if (tick.label.empty()) continue;
      canvas_.text(left_ - tick_length - 4, y + 4, tick.label, {.colour = &faint_words, .anchor = "end"});
    }
    for (const Tick& tick : x_->ticks()) {
      const double x = left_ + x_of(tick.at);
      if (f_.x_axis.categories.empty() && !tick.label.empty()) canvas_.line(x, top, x, top + height, grid);
      canvas_.line(x, top + height, x, top + height + (tick.label.empty() ? tick_length / 2 : tick_length), frame);
    }
    canvas_.line(left_, top, left_, top + height, frame);
    canvas_.line(left_, top + height, left_ + width_, top + height, frame);

    // What is drawn of the data is cut off at the frame.
    canvas_.raw("<svg x=\"" + px(left_) + "\" y=\"" + px(top) + "\" width=\"" + px(width_) + "\" height=\"" +
                px(height) + "\">\n");
    for (const Trace& t : p.traces)
      if (t.kind == Trace::Kind::band) band(t, place_of);
    for (const Reference& r : p.references) {
      if (r.vertical) {
        canvas_.line(x_of(r.at), 0, x_of(r.at), height, colour_of(r.pen.ink), r.pen.width, dashes(r.pen));
      } else {
        canvas_.line(0, place_of(r.at), width_, place_of(r.at), colour_of(r.pen.ink), r.pen.width, dashes(r.pen));
      }
    }
    const double zero = ys.share(0) > 0 && ys.share(0) < 1 ? place_of(0) : height;
    std::size_t sets = 0, set = 0;  // bars that stand beside each other at the same place
    for (const Trace& t : p.traces) sets += t.kind == Trace::Kind::bars || t.kind == Trace::Kind::horizontal_bars;
    for (const Trace& t : p.traces) {
      switch (t.kind) {
        case Trace::Kind::band:
          break;
        case Trace::Kind::line:
        case Trace::Kind::steps:
          canvas_.curve(curve(t, place_of), t.pen);
          break;
        case Trace::Kind::points:
          points(t, place_of);
          break;
        case Trace::Kind::bars:
          bars(t, set++, sets, place_of, zero);
          break;
        case Trace::Kind::horizontal_bars:
          horizontal_bars(t, set++, sets, place_of, ys);
          break;
      }
    }
    for (const Trace& t : p.traces)
      if (t.kind == Trace::Kind::band) band_edges(t, place_of);
    canvas_.raw("</svg>\n");

    set = 0;
    for (const Trace& t : p.traces) {
      data_labels(t, top, place_of, ys, set, sets);
      set += t.kind == Trace::Kind::bars || t.kind == Trace::Kind::horizontal_bars;
    }
    for (const Shade& s : p.shades) {
      if (s.label.empty()) continue;
      const double a = std::clamp(x_of(s.from), 0.0, width_), b = std::clamp(x_of(s.to), 0.0, width_);
      canvas_.text(left_ + 0.5 * (a + b), top - 4, s.label, {.colour = &faint_words, .anchor = "middle", .halo = true});
    }
    for (const Reference& r : p.references) {
      if (r.label.empty()) continue;
      if (r.vertical) {
        const double x = x_of(r.at);
        const bool left_of_it = x + 6 + width_of(r.label) > width_;
        canvas_.text(left_ + x + (left_of_it ? -5 : 5), top + 12, r.label,
                     {.colour = &faint_words, .anchor = left_of_it ? "end" : "start", .halo = true});
      } else {
        const double y = place_of(r.at);
        canvas_.text(left_ + width_ - 4, top + (y < 16 ? y + 13 : y - 4), r.label,
                     {.colour = &faint_words, .anchor = "end", .halo = true});
      }
    }
    for (const Note& n : p.notes) {
      const double x = x_of(n.x);
      const bool right = x > 0.6 * width_;
      canvas_.text(left_ + x, top + std::clamp(place_of(n.y), 12.0, height - 4), n.text,
                   {.anchor = right ? "end" : "start", .halo = true});
    }
    if (direct_[i]) {
      const std::vector<const Trace*> list = named(i);
      std::vector<double> ends(list.size());
      std::ranges::transform(list, ends.begin(), [&](const Trace* t) { return place_of(t->y.back()); });
      spread(ends, 0, height);
      for (std::size_t k = 0; k < list.size(); ++k) {
        canvas_.text(left_ + width_ + 6, top + ends[k] + 4, list[k]->name, {.colour = &colour_of(list[k]->pen.ink)});
      }
    }
  }

  template <class Place>
  Pixels curve(const Trace& t, const Place& place_of) const {
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

  template <class Place>
  void band(const Trace& t, const Place& place_of) {
    // Piece by piece between gaps.
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
  template <class Place>
  void band_edges(const Trace& t, const Place& place_of) {
    for (const std::vector<double>* edge_of : {&t.low, &t.high}) {
      Trace line = t;
      line.kind = Trace::Kind::line;
      line.y = *edge_of;
      canvas_.curve(curve(line, place_of), {t.pen.ink, 0.7, Dash::solid});
    }
  }

  template <class Place>
  void points(const Trace& t, const Place& place_of) {
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
      if (!many && !t.low.empty()) {
        const double a = place_of(t.low[k]), b = place_of(t.high[k]);
        if (std::isfinite(a) && std::isfinite(b)) {
          canvas_.line(xs[k], a, xs[k], b, colour_of(t.pen.ink), t.pen.width);
          for (const double y : {a, b}) canvas_.line(xs[k] - 3, y, xs[k] + 3, y, colour_of(t.pen.ink), t.pen.width);
        }
      }
      if (!many && !t.left.empty()) {
        const double a = std::clamp(x_of(t.left[k]), -9.0, width_ + 9),
                     b = std::clamp(x_of(t.right[k]), -9.0, width_ + 9);
        canvas_.line(a, ys[k], b, ys[k], colour_of(t.pen.ink), t.pen.width);
        for (const double x : {a, b}) canvas_.line(x, ys[k] - 4, x, ys[k] + 4, colour_of(t.pen.ink), t.pen.width);
      }
      canvas_.marker(xs[k], ys[k], t.pen);
    }
  }

  /// How wide a bar is: four fifths of the room from place to place, shared by the sets.
  double bar_width(const Trace& t, double pixels_a_unit, std::size_t sets) const {
    std::vector<double> places = t.kind == Trace::Kind::bars ? t.x : t.y;
    std::ranges::sort(places);
    double distance = 1e300;
    for (std::size_t k = 1; k < places.size(); ++k)
      if (places[k] > places[k - 1]) distance = std::min(distance, places[k] - places[k - 1]);
    if (distance > 1e299) distance = 1;
    return std::clamp(0.8 * distance * pixels_a_unit / static_cast<double>(sets), 1.0, 64.0);
  }
  static double offset(double width, std::size_t set, std::size_t sets) {
    return width * (static_cast<double>(set) - 0.5 * static_cast<double>(sets));
  }

  template <class Place>
  void bars(const Trace& t, std::size_t set, std::size_t sets, const Place& place_of, double zero) {
    const double width = bar_width(t, width_ / (x_->range().high - x_->range().low), sets);
    for (std::size_t k = 0; k < t.x.size(); ++k) {
      const double y = place_of(t.y[k]);
      if (!std::isfinite(y)) continue;
      canvas_.rectangle(x_of(t.x[k]) + offset(width, set, sets), std::min(y, zero), width - 1,
                        std::max(1.0, std::abs(y - zero)), colour_of(t.pen.ink), 0.9);
    }
  }

  template <class Place>
  void horizontal_bars(const Trace& t, std::size_t set, std::size_t sets, const Place& place_of, const Scale& ys) {
    const double height = bar_height(t, place_of, ys, sets);
    const double zero = x_->share(0) > 0 ? x_of(0) : 0;
    for (std::size_t k = 0; k < t.x.size(); ++k) {
      const double x = x_of(t.x[k]);
      if (!std::isfinite(x)) continue;
      canvas_.rectangle(std::min(x, zero), place_of(t.y[k]) + offset(height, set, sets),
                        std::max(1.0, std::abs(x - zero)), height - 1, colour_of(t.pen.ink), 0.9);
    }
  }
  template <class Place>
  double bar_height(const Trace& t, const Place& place_of, const Scale& ys, std::size_t sets) const {
    const double pixels = std::abs(place_of(1) - place_of(0));
    return std::min(20.0, bar_width(t, std::isfinite(pixels) ? pixels : 1 / (ys.range().high - ys.range().low), sets));
  }

  template <class Place>
  void data_labels(const Trace& t, double top, const Place& place_of, const Scale& ys, std::size_t set,
                   std::size_t sets) {
    for (std::size_t k = 0; k < t.labels.size(); ++k) {
      double x = x_of(t.x[k]), y = place_of(t.y[k]);
      if (t.labels[k].empty() || !std::isfinite(y)) continue;
      if (t.kind == Trace::Kind::horizontal_bars) {
        const double height = bar_height(t, place_of, ys, sets);
        if (!std::isfinite(x)) x = 0;
        x = std::max({x, x_->share(0) > 0 ? x_of(0) : 0.0, 0.0});
        canvas_.text(left_ + x + 6, top + y + offset(height, set, sets) + height / 2 + 4, t.labels[k], {.halo = true});
        continue;
      }
      if (t.kind == Trace::Kind::bars) {
        const double width = bar_width(t, width_ / (x_->range().high - x_->range().low), sets);
        x += offset(width, set, sets) + width / 2;
      }
      canvas_.text(left_ + std::clamp(x, 0.5 * width_of(t.labels[k]) - left_ + 2, width_), top + std::max(8.0, y - 7),
                   t.labels[k], {.anchor = "middle", .halo = true});
    }
  }

  /// A category's name in lines that fit its place.
  std::vector<std::string> wrapped(const std::string& name) const {
    const double room = width_ / static_cast<double>(f_.x_axis.categories.size()) - 6;
    std::vector<std::string> lines{""};
    for (std::size_t i = 0; i < name.size();) {
      const std::size_t end = std::min(name.find(' ', i), name.size());
      const std::string word = name.substr(i, end - i);
      if (!lines.back().empty() && width_of(lines.back() + " " + word) > room) lines.emplace_back();
      lines.back() += (lines.back().empty() ? "" : " ") + word;
      i = end + 1;
    }
    return lines;
  }

  void x_axis(double bottom) {
    const double y = bottom + tick_length + 13;
    double free_from = -1e9;
    for (const Tick& tick : x_->ticks()) {
      if (tick.label.empty()) continue;
      const double x = x_of(tick.at);
      if (!f_.x_axis.categories.empty()) {
        double line = y;
        for (const std::string& text : wrapped(tick.label)) {
          canvas_.text(left_ + x, line, text, {.colour = &faint_words, .anchor = "middle"});
          line += line_height - 2;
        }
        continue;
      }
      const double half = 0.5 * width_of(tick.label);
      if (x - half < free_from) continue;
      canvas_.text(left_ + x, y, tick.label, {.colour = &faint_words, .anchor = "middle"});
      free_from = x + half + 4;
    }
    if (x_->title().empty()) return;
    canvas_.text(left_ + width_ / 2, y + line_height * static_cast<double>(x_lines_), x_->title(),
                 {.anchor = "middle", .bold = true});
  }

  static constexpr double band_opacity = 0.2;

  const Figure& f_;
  Canvas canvas_;
  Theme theme_;
  std::vector<Scale> y_;
  std::optional<Scale> x_;
  std::vector<char> direct_;  // are the traces of that panel named at their ends?
  std::vector<double> heads_;
  std::size_t x_lines_ = 1;
  double left_ = 0, right_ = 0, top_ = 0, width_ = 0, height_ = 0;
};

}  // namespace

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        if (static_cast<unsigned char>(c) >= 0x20 || c == '\n' || c == '\t') out += c;  // others are not XML
    }
  }
  return out;
}

std::string to_svg(const Figure& figure, Theme theme) { return Drawing(figure, theme).draw(); }

std::string svg_style() {
  std::string light, dark, rules;
  const auto add = [&](const Colour& c) {
    const std::string name = c.name;
    light += "--" + name + ":" + c.light + ";";
    dark += "--" + name + ":" + c.dark + ";";
    rules += ".f-" + name + "{fill:var(--" + name + ")}.s-" + name + "{stroke:var(--" + name + ");fill:none}\n";
  };
  for (const Colour& c : inks) add(c);
  for (const Colour* c : {&paper, &words, &faint_words, &grid, &frame, &shadow}) add(*c);
  return ":root{color-scheme:light dark;" + light + "}\n@media screen and (prefers-color-scheme:dark){:root{" + dark +
         "}}\n" + rules + ".halo{paint-order:stroke;stroke:var(--paper);stroke-width:3px;stroke-linejoin:round}\n" +
         "svg.figure{display:block;width:100%;height:auto;font:" + px(text_size) + "px " + font + "}\n";
}

void write_svg(const Figure& figure, const std::filesystem::path& path) {
  std::ofstream out(path);
  out << to_svg(figure, Theme::standalone);
  if (!out.flush()) throw Error(path.string() + ": cannot be written. Give a file in a folder that exists");
}

}  // namespace emtb
