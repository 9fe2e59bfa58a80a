#include "figures/svg_canvas.h"

#include <algorithm>
#include <cmath>

#include "figures/escape.h"

namespace emtb::svg {
namespace {

Marker marker_of(const Pen& pen) {
  static constexpr Marker of_ink[] = {Marker::circle,  Marker::square,   Marker::circle,  Marker::triangle,
                                      Marker::diamond, Marker::triangle, Marker::diamond, Marker::circle};
  return pen.marker == Marker::of_ink ? of_ink[static_cast<std::size_t>(pen.ink)] : pen.marker;
}

std::string path_of(const Pixels& p) {
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

std::string marked_up(const std::string& text) {
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

}  // namespace

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

std::string px(double value) {
  long tenths = std::lround(10 * value);
  std::string text = tenths < 0 ? "-" : "";
  tenths = std::abs(tenths);
  const long whole = tenths / 10, rest = tenths % 10;
  if (whole > 0 || rest == 0) text += std::to_string(whole);
  if (rest > 0) text += "." + std::to_string(rest);
  return text;
}

double width_of(const std::string& marked, double size) {
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

void Canvas::line(double x1, double y1, double x2, double y2, const Colour& colour, double width, const char* dash) {
  svg_ +=
      "<path d=\"M" + px(x1) + " " + px(y1) + "L" + px(x2) + " " + px(y2) + "\"" + stroke(colour, width, dash) + "/>\n";
}

void Canvas::rectangle(double x, double y, double width, double height, const Colour& colour, double opacity) {
  svg_ += "<rect x=\"" + px(x) + "\" y=\"" + px(y) + "\" width=\"" + px(std::max(0.0, width)) + "\" height=\"" +
          px(std::max(0.0, height)) + "\"" + fill(colour, opacity) + "/>\n";
}

void Canvas::text(double x, double y, const std::string& marked, const Font& how) {
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
  svg_ += "<text x=\"" + px(x) + "\" y=\"" + px(y) + "\"" + colour + attributes + ">" + marked_up(marked) + "</text>\n";
}

void Canvas::curve(const Pixels& p, const Pen& pen) {
  const std::string path = path_of(p);
  if (path.empty()) return;
  svg_ += "<path d=\"" + path + "\"" + stroke(colour_of(pen.ink), pen.width, dashes(pen)) +
          " stroke-linejoin=\"round\"/>\n";
}

void Canvas::area(const Pixels& above, const Pixels& below, const Colour& colour, double opacity) {
  if (above.x.empty()) return;
  Pixels around = above;
  around.x.insert(around.x.end(), below.x.rbegin(), below.x.rend());
  around.y.insert(around.y.end(), below.y.rbegin(), below.y.rend());
  svg_ += "<path d=\"" + path_of(around) + "z\"" + fill(colour, opacity) + "/>\n";
}

void Canvas::marker(double x, double y, const Pen& pen) {
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

std::string Canvas::stroke(const Colour& colour, double width, const char* dash) const {
  std::string text = theme_ == Theme::page ? " class=\"s-" + std::string(colour.name) + "\""
                                           : " fill=\"none\" stroke=\"" + std::string(colour.light) + "\"";
  if (width != 1) text += " stroke-width=\"" + px(width) + "\"";
  if (*dash != 0) text += " stroke-dasharray=\"" + std::string(dash) + "\"";
  return text;
}

std::string Canvas::fill(const Colour& colour, double opacity) const {
  std::string text = theme_ == Theme::page ? " class=\"f-" + std::string(colour.name) + "\""
                                           : " fill=\"" + std::string(colour.light) + "\"";
  if (opacity < 1) text += " fill-opacity=\"" + px(opacity) + "\"";
  return text;
}

}  // namespace emtb::svg
