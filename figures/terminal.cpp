#include "figures/terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "figures/scale.h"

namespace emtb {
namespace {

constexpr int dots_across = 2, dots_down = 4;                       // of a braille character
constexpr std::array<int, 8> ansi{90, 33, 34, 32, 93, 35, 36, 39};  // in the order of Ink

std::size_t columns_of(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; }));
}

std::string spaces(std::size_t n) { return std::string(n, ' '); }

/// Dots that become characters. The last ink that touches a character colours it.
class Dots {
 public:
  Dots(int columns, int rows) : columns_(columns), rows_(rows), cells_(place(rows, 0)), inks_(cells_.size()) {}

  int width() const { return columns_ * dots_across; }
  int height() const { return rows_ * dots_down; }

  void set(int x, int y, Ink ink) {
    if (x < 0 || y < 0 || x >= width() || y >= height()) return;
    static constexpr unsigned char bit[dots_down][dots_across] = {
        {0x01, 0x08}, {0x02, 0x10}, {0x04, 0x20}, {0x40, 0x80}};
    const std::size_t cell = place(y / dots_down, x / dots_across);
    cells_[cell] |= bit[y % dots_down][x % dots_across];
    inks_[cell] = ink;
  }

  void line(double x0, double y0, double x1, double y1, Ink ink) {
    const int n = static_cast<int>(std::clamp(std::ceil(std::max(std::abs(x1 - x0), std::abs(y1 - y0))), 1.0, 1e4));
    for (int i = 0; i <= n; ++i) {
      const double s = static_cast<double>(i) / n;
      set(static_cast<int>(std::lround(x0 + s * (x1 - x0))), static_cast<int>(std::lround(y0 + s * (y1 - y0))), ink);
    }
  }

  std::string row(int r, bool colour) const {
    std::string out;
    int now = 0;
    for (int c = 0; c < columns_; ++c) {
      const std::size_t cell = place(r, c);
      const int wanted = colour && cells_[cell] != 0 ? ansi[static_cast<std::size_t>(inks_[cell])] : 0;
      if (wanted != now && colour) out += "\033[" + std::to_string(wanted) + "m";
      now = wanted;
      if (cells_[cell] == 0) {
        out += ' ';
      } else {  // U+2800 and the dots' bits, as UTF-8
        out += static_cast<char>(0xE2);
        out += static_cast<char>(0xA0 | cells_[cell] >> 6);
        out += static_cast<char>(0x80 | (cells_[cell] & 0x3F));
      }
    }
    if (now != 0) out += "\033[0m";
    return out;
  }

 private:
  std::size_t place(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column);
  }

  int columns_, rows_;
  std::vector<unsigned char> cells_;
  std::vector<Ink> inks_;
};

bool drawn(const Trace& t) { return t.kind != Trace::Kind::bars && t.kind != Trace::Kind::horizontal_bars; }

void draw(const Trace& t, const Scale& xs, const Scale& ys, Dots& dots) {
  const auto curve = [&](const std::vector<double>& y) {
    Pixels p;
    for (std::size_t k = 0; k < t.x.size(); ++k) {
      const double x = xs.share(t.x[k]) * (dots.width() - 1);
      const double place = (1 - ys.share(y[k])) * (dots.height() - 1);
      if (t.kind == Trace::Kind::steps && k > 0) p.x.push_back(x), p.y.push_back(p.y.back());
      p.x.push_back(x);
      p.y.push_back(place);
    }
    p = thinned(p.x, p.y);
    for (std::size_t k = 0; k < p.x.size(); ++k) {
      if (!std::isfinite(p.x[k]) || !std::isfinite(p.y[k])) continue;
      const bool join = t.kind != Trace::Kind::points && k > 0 && std::isfinite(p.y[k - 1]);
      const double from_x = join ? p.x[k - 1] : p.x[k], from_y = join ? p.y[k - 1] : p.y[k];
      dots.line(from_x, from_y, p.x[k], p.y[k], t.pen.ink);
    }
  };
  if (t.kind == Trace::Kind::band) {
    curve(t.low);
    curve(t.high);
  } else {
    curve(t.y);
  }
}

int rows_of(const Panel& panel, const TerminalStyle& style) {
  return std::max(3, static_cast<int>(std::lround(style.lines * panel.height / 200)));
}

/// What y is, and the legend.
std::string head_of(const Panel& panel, const Scale& ys, bool colour) {
  std::string head = plain(ys.title());
  for (const Trace& t : panel.traces) {
    if (!drawn(t) || t.name.empty()) continue;
    const std::string code = colour ? "\033[" + std::to_string(ansi[static_cast<std::size_t>(t.pen.ink)]) + "m" : "";
    head += "   " + code + "── " + plain(t.name) + (colour ? "\033[0m" : "");
  }
  return head;
}

Dots dots_of(const Panel& panel, const Scale& xs, const Scale& ys, int columns, int rows) {
  Dots dots(columns, rows);
  for (const Reference& r : panel.references) {  // first, so that what is measured hides them
    if (r.vertical) continue;
    const int y = static_cast<int>(std::lround((1 - ys.share(r.at)) * (dots.height() - 1)));
    for (int x = 0; x < dots.width(); x += 4) dots.set(x, y, r.pen.ink);
  }
  for (const bool band : {true, false}) {
    for (const Trace& t : panel.traces)
      if (drawn(t) && (t.kind == Trace::Kind::band) == band) draw(t, xs, ys, dots);
  }
  return dots;
}

/// The rows of a panel, with the labels of y before them.
std::string panel_of(const Dots& dots, const Scale& ys, int rows, std::size_t margin, bool colour) {
  std::vector<std::string> labels(static_cast<std::size_t>(rows));
  for (const Tick& tick : ys.ticks()) {
    const double share = ys.share(tick.at);
    const long row = std::lround((1 - share) * (dots.height() - 1)) / dots_down;
    if (row >= 0 && row < rows) labels[static_cast<std::size_t>(row)] = tick.label;
  }
  std::string out;
  for (int r = 0; r < rows; ++r) {
    const std::string& label = labels[static_cast<std::size_t>(r)];
    std::string line = spaces(margin - columns_of(label)) + label + (label.empty() ? " │" : " ┤") + dots.row(r, colour);
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + "\n";
  }
  return out;
}

/// The line under the panels, and what x is.
std::string x_axis_of(const Scale& xs, std::size_t margin, int columns, const TerminalStyle& style) {
  std::string rule(margin, ' '), labels = spaces(margin + 2);
  rule += " └";
  std::vector<char> marked(static_cast<std::size_t>(columns), 0);
  for (const Tick& tick : xs.ticks()) {
    const auto at = static_cast<std::size_t>(
        std::clamp(std::lround(xs.share(tick.at) * (columns - 1)), 0L, static_cast<long>(columns) - 1));
    marked[at] = 1;
    const std::size_t length = columns_of(tick.label), begin = margin + 2 + at - std::min(at, length / 2);
    if (begin < columns_of(labels) + (columns_of(labels) > margin + 2 ? 1 : 0)) continue;
    if (begin + length > static_cast<std::size_t>(style.width)) continue;
    labels += spaces(begin - columns_of(labels)) + tick.label;
  }
  for (const char mark : marked) rule += mark != 0 ? "┴" : "─";
  const std::string title = plain(xs.title());
  if (columns_of(labels) + 1 + columns_of(title) <= static_cast<std::size_t>(style.width)) {
    labels += " " + title;
  } else {
    labels += "\n" + spaces(margin + 2 + (static_cast<std::size_t>(columns) - columns_of(title)) / 2) + title;
  }
  return rule + "\n" + labels + "\n";
}

}  // namespace

std::string to_terminal(const Figure& figure, const TerminalStyle& style) {
  std::vector<Scale> ys;
  std::size_t margin = 0;
  for (const Panel& p : figure.panels) {
    ys.emplace_back(p.y_axis, y_range(p), 0.04, rows_of(p, style) / 3.0);
    for (const Tick& tick : ys.back().ticks()) margin = std::max(margin, columns_of(tick.label));
  }
  const int columns = std::max(16, style.width - static_cast<int>(margin) - 3);
  const Scale xs(figure.x_axis, x_range(figure), 0, columns / 12.0);
  std::string out = figure.title.empty() ? "" : plain(figure.title) + "\n";
  for (std::size_t i = 0; i < figure.panels.size(); ++i) {
    const Panel& p = figure.panels[i];
    const int rows = rows_of(p, style);
    out += head_of(p, ys[i], style.colour) + "\n" +
           panel_of(dots_of(p, xs, ys[i], columns, rows), ys[i], rows, margin, style.colour);
  }
  return out + x_axis_of(xs, margin, columns, style);
}

TerminalStyle style_of_stdout() {
  TerminalStyle style;
  if (isatty(STDOUT_FILENO) != 1) return style;
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col >= 40) style.width = size.ws_col;
  style.colour = std::getenv("NO_COLOR") == nullptr;
  return style;
}

std::size_t width_of_prose() { return static_cast<std::size_t>(style_of_stdout().width); }

std::size_t width_of_rows() { return isatty(STDOUT_FILENO) == 1 ? width_of_prose() : std::string::npos; }

}  // namespace emtb
