#include <algorithm>
#include <cmath>
#include <fstream>

#include "figures/escape.h"
#include "figures/figure.h"
#include "figures/svg_canvas.h"
#include "figures/svg_layout.h"
#include "figures/svg_panel.h"
#include "hal/error.h"

namespace emtb {
namespace svg {
namespace {

void draw_x_axis(Canvas& canvas, const Layout& layout, double bottom) {
  const double y = bottom + tick_length + 13;
  double free_from = -1e9;
  for (const Tick& tick : layout.x().ticks()) {
    if (tick.label.empty()) continue;
    const double x = layout.x_of(tick.at);
    if (!layout.figure().x_axis.categories.empty()) {
      double line = y;
      for (const std::string& text : layout.wrapped(tick.label)) {
        canvas.text(layout.left() + x, line, text, {.colour = &faint_words, .anchor = "middle"});
        line += line_height - 2;
      }
      continue;
    }
    const double half = 0.5 * width_of(tick.label);
    if (x - half < free_from) continue;
    canvas.text(layout.left() + x, y, tick.label, {.colour = &faint_words, .anchor = "middle"});
    free_from = x + half + 4;
  }
  if (layout.x().title().empty()) return;
  const double half = 0.53 * width_of(layout.x().title()), width = layout.figure().width;  // bold
  const double middle = std::max(half, std::min(layout.left() + layout.width() / 2, width - half - 2));
  canvas.text(middle, y + line_height * static_cast<double>(layout.x_lines()), layout.x().title(),
              {.anchor = "middle", .bold = true});
}

std::string opening_tag(const Figure& figure, const Layout& layout, Theme theme) {
  const std::string size = px(figure.width) + " " + px(layout.height());
  const std::string title = escaped(plain(figure.title));
  std::string tag = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + size + "\" role=\"img\"";
  if (theme == Theme::page) {
    tag += " class=\"figure\" style=\"max-width:" + px(figure.width) + "px\"";
  } else {
    tag += " width=\"" + px(figure.width) + "\" height=\"" + px(layout.height()) + "\" font-family=\"" + font +
           "\" font-size=\"" + px(text_size) + "\"";
  }
  return tag + " aria-label=\"" + title + "\">\n<title>" + title + "</title>\n<desc>" +
         escaped(plain(figure.description)) + "</desc>\n";
}

}  // namespace
}  // namespace svg

std::string to_svg(const Figure& figure, Theme theme) {
  using namespace svg;
  const Layout layout(figure);
  Canvas canvas(theme);
  canvas.raw(opening_tag(figure, layout, theme));
  if (theme == Theme::standalone) canvas.rectangle(0, 0, figure.width, layout.height(), paper);
  double line = edge + title_size;
  for (const std::string& words : layout.title_lines()) {
    canvas.text(edge, line, words, {.size = title_size, .bold = true});
    line += line_height;
  }
  double y = layout.top();
  for (std::size_t i = 0; i < figure.panels.size(); ++i) {
    y += layout.head_height(i);
    draw_panel(canvas, layout, i, y);
    y += figure.panels[i].height + gap;
  }
  draw_x_axis(canvas, layout, y - gap);
  canvas.raw("</svg>\n");
  return canvas.take();
}

std::string svg_style() {
  using namespace svg;
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
