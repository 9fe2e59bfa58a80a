#include "report/page.h"

#include <algorithm>
#include <cassert>

#include "figures/escape.h"
#include "figures/scale.h"

namespace emtb {
namespace {

constexpr const char* style = R"(
*{box-sizing:border-box}
html{background:var(--paper);color:var(--words);font:16px/1.5 system-ui,-apple-system,'Segoe UI',Helvetica,Arial,sans-serif;
  -webkit-text-size-adjust:100%}
body{max-width:58rem;margin:0 auto;padding:1.5rem 1rem 4rem}
h1{font-size:1.7rem;line-height:1.2;margin:.5rem 0 .2rem}
h2{font-size:1.3rem;line-height:1.25;margin:3rem 0 .6rem;padding-top:.8rem;border-top:2px solid var(--grid)}
h3{font-size:1.05rem;margin:2rem 0 .3rem}
p{margin:.6rem 0}
.summary,figcaption,caption{color:var(--faint)}
.lead{font-size:1.15rem;border-left:4px solid var(--blue);padding:.4rem 0 .4rem 1rem;margin:1rem 0}
nav{font-size:.9rem;margin:1rem 0}
nav a{display:inline-block;margin-right:1.1rem;padding:.25rem 0;white-space:nowrap}
a{color:var(--blue)}
figure{margin:1.4rem 0;break-inside:avoid}
figcaption{font-size:.9rem;margin-top:.3rem;max-width:46rem}
.plot.narrow{display:none}
.hero{display:grid;grid-template-columns:3fr 2fr;gap:1rem 1.5rem;align-items:start}
.hero figure{margin:.8rem 0}
dl{display:grid;grid-template-columns:max-content 1fr;gap:.3rem 1rem;margin:1rem 0}
dt{font-weight:600}
dd{margin:0}
details{margin:.8rem 0}
details>summary{font-weight:600;padding:.25rem 0}
.multiples{display:grid;grid-template-columns:repeat(auto-fill,minmax(15.5rem,1fr));gap:.9rem 1rem}
.multiples .plot{break-inside:avoid}
.scroll{overflow-x:auto;margin:1rem 0}
table{border-collapse:collapse;font-size:.86rem;min-width:60%;font-variant-numeric:tabular-nums}
caption{text-align:left;padding-bottom:.35rem}
th,td{padding:.25rem .6rem .25rem 0;border-bottom:1px solid var(--grid);text-align:left;vertical-align:top}
thead th{border-bottom:1px solid var(--frame);vertical-align:bottom}
tbody th{font-weight:600;white-space:nowrap}
.r{text-align:right;white-space:nowrap}
td code{white-space:normal}
code,pre{font:.86em/1.45 ui-monospace,'DejaVu Sans Mono','Liberation Mono',Menlo,monospace}
code{overflow-wrap:anywhere}
pre{background:var(--shade);padding:.7rem .9rem;white-space:pre-wrap;overflow-wrap:anywhere}
summary{cursor:pointer}
sub{font-size:.75em;line-height:0}
@media screen and (max-width:40rem){
  .plot.whole{display:none}
  .plot.narrow{display:block}
  .hero,dl{display:block}
  dd{margin-bottom:.5rem}
  thead th,tbody th{white-space:normal;overflow-wrap:anywhere}
  .cards,.cards tbody,.cards tr,.cards th,.cards td,.cards caption{display:block;text-align:left;white-space:normal}
  .cards thead{display:none}
  .cards tr{border-bottom:1px solid var(--frame);padding:.35rem 0}
  .cards th,.cards td{border:0;padding:.1rem 0;overflow-wrap:anywhere}
  .cards td::before{content:attr(data-is) ": ";color:var(--faint)}
}
@media print{
  @page{size:A4;margin:16mm 14mm}
  html{font-size:10.5pt}
  body{max-width:none;padding:0}
  nav{display:none}
  section+section:not(.short){break-before:page}
  h2{margin-top:0;border:0;padding:0}
  h2,h3,.lead,summary{break-after:avoid}
  details::details-content{content-visibility:visible;display:block}
  details>summary{list-style:none}
  tr,pre{break-inside:avoid}
  table{font-size:8.5pt;min-width:0;width:100%}
  th,td{padding-right:.45rem}
  thead{display:table-header-group}
  .scroll{overflow:visible}
  .multiples{grid-template-columns:repeat(3,1fr)}
  *{print-color-adjust:exact;-webkit-print-color-adjust:exact}
}
)";

/// Escapes; sets `_{..}` as subscripts and what stands in backticks as code.
std::string marked_up(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const bool code = text[i] == '`';
    const bool subscript = text.compare(i, 2, "_{") == 0;
    if (code || subscript) {
      const std::size_t begin = i + (code ? 1 : 2), end = text.find(code ? '`' : '}', begin);
      if (end != std::string::npos) {
        const std::string inner = escaped(text.substr(begin, end - begin));
        out += code ? "<code>" + inner + "</code>" : "<sub>" + inner + "</sub>";
        i = end + 1;
        continue;
      }
    }
    const std::size_t next = std::min({text.find('`', i + 1), text.find("_{", i + 1), text.size()});
    out += escaped(text.substr(i, next - i));
    i = next;
  }
  return out;
}

/// Without backticks, for a window's title.
std::string without_marks(std::string text) {
  std::erase(text, '`');
  return text;
}

/// On a phone there is room for a bar's value at its end; what stands behind the colon stands in the table, too.
void shorten_labels(Figure& figure) {
  for (Panel& panel : figure.panels) {
    for (Trace& trace : panel.traces) {
      if (trace.kind != Trace::Kind::horizontal_bars) continue;
      for (std::string& label : trace.labels) label.resize(std::min(label.size(), label.find(": ")));
    }
  }
}

/// A figure, and where it is too wide for a phone, once more as wide as that.
std::string drawn(const Figure& figure) {
  constexpr double phone = 380;  // [px]
  if (figure.width <= phone) return "<div class=\"plot\">" + to_svg(figure, Theme::page) + "</div>";
  Figure narrow = figure;
  narrow.width = phone;
  shorten_labels(narrow);
  return "<div class=\"plot whole\">" + to_svg(figure, Theme::page) + "</div><div class=\"plot narrow\">" +
         to_svg(narrow, Theme::page) + "</div>";
}

std::string anchor(std::size_t section) { return "s" + std::to_string(section); }

}  // namespace

Page::Page(std::string title, std::string summary, std::function<void(const NamedFigure&)> on_figure)
    : title_(std::move(title)), summary_(std::move(summary)), on_figure_(std::move(on_figure)) {}

Page& Page::section(const std::string& heading, bool on_new_page) {
  if (!sections_.empty()) body_ += "</section>\n";
  body_ += "<section id=\"" + anchor(sections_.size()) + "\"" + (on_new_page ? "" : " class=\"short\"") + ">\n<h2>" +
           marked_up(heading) + "</h2>\n";
  sections_.push_back(heading);
  return *this;
}

Page& Page::subsection(const std::string& heading) {
  body_ += "<h3>" + marked_up(heading) + "</h3>\n";
  return *this;
}

Page& Page::paragraph(const std::string& text) {
  body_ += "<p>" + marked_up(text) + "</p>\n";
  return *this;
}

Page& Page::lead(const std::string& text) {
  body_ += "<p class=\"lead\">" + marked_up(text) + "</p>\n";
  return *this;
}

Page& Page::list(const std::vector<std::string>& items) {
  body_ += "<ul>\n";
  for (const std::string& item : items) body_ += "<li>" + marked_up(item) + "</li>\n";
  body_ += "</ul>\n";
  return *this;
}

Page& Page::code(const std::string& text) {
  body_ += "<pre>" + escaped(text) + "</pre>\n";
  return *this;
}

Page& Page::fold(const std::string& heading, bool open) {
  body_ += "<details" + std::string(open ? " open=\"\"" : "") + "><summary>" + marked_up(heading) + "</summary>\n";
  ++folds_;
  return *this;
}

Page& Page::end_fold() {
  assert(folds_ > 0);
  body_ += "</details>\n";
  --folds_;
  return *this;
}

Page& Page::folded(const std::string& heading, const std::string& text) { return fold(heading).code(text).end_fold(); }

Page& Page::facts(const std::vector<std::pair<std::string, std::string>>& facts) {
  body_ += "<dl>\n";
  for (const auto& [word, what] : facts) body_ += "<dt>" + marked_up(word) + "</dt><dd>" + marked_up(what) + "</dd>\n";
  body_ += "</dl>\n";
  return *this;
}

Page& Page::table(const std::string& caption, const std::string& columns, const std::vector<std::string>& heading,
                  const std::vector<std::vector<std::string>>& rows) {
  constexpr std::size_t most_on_a_phone = 3;  // columns beside each other
  const auto align = [&](std::size_t i) { return columns.at(i) == 'r' ? " class=\"r\"" : ""; };
  const bool cards = heading.size() > most_on_a_phone;
  body_ += "<div class=\"scroll\"><table" + std::string(cards ? " class=\"cards\"" : "") + "><caption>" +
           marked_up(caption) + "</caption>\n<thead><tr>";
  for (std::size_t i = 0; i < heading.size(); ++i) {
    body_ += "<th scope=\"col\"" + std::string(align(i)) + ">" + marked_up(heading[i]) + "</th>";
  }
  body_ += "</tr></thead>\n<tbody>\n";
  for (const auto& row : rows) {
    assert(row.size() == heading.size());
    body_ += "<tr><th scope=\"row\">" + marked_up(row.front()) + "</th>";
    for (std::size_t i = 1; i < row.size(); ++i)
      body_ += "<td" + std::string(align(i)) + " data-is=\"" + escaped(plain(without_marks(heading[i]))) + "\">" +
               marked_up(row[i]) + "</td>";
    body_ += "</tr>\n";
  }
  body_ += "</tbody></table></div>\n";
  return *this;
}

Page& Page::figure(const NamedFigure& named) {
  body_ += "<figure>" + drawn(named.figure) + "<figcaption>" + marked_up(named.caption) + "</figcaption></figure>\n";
  if (on_figure_) on_figure_(named);
  return *this;
}

Page& Page::side_by_side(const std::vector<NamedFigure>& figures) {
  body_ += figures.size() > 1 ? "<div class=\"hero\">\n" : "<div>\n";
  for (const NamedFigure& named : figures) figure(named);
  body_ += "</div>\n";
  return *this;
}

Page& Page::small_multiples(const std::vector<NamedFigure>& figures, const std::string& caption) {
  body_ += "<figure><div class=\"multiples\">\n";
  for (const NamedFigure& named : figures) {
    body_ += "<div class=\"plot\">" + to_svg(named.figure, Theme::page) + "</div>\n";
    if (on_figure_) on_figure_(named);
  }
  body_ += "</div><figcaption>" + marked_up(caption) + "</figcaption></figure>\n";
  return *this;
}

std::string Page::html() const {
  assert(folds_ == 0);
  std::string nav;
  for (std::size_t i = 0; i < sections_.size(); ++i) {
    nav += "<a href=\"#" + anchor(i) + "\">" + marked_up(sections_[i]) + "</a> ";
  }
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
         escaped(without_marks(title_)) + "</title>\n<style>\n" + svg_style() + style +
         "</style>\n</head>\n<body>\n<header><h1>" + marked_up(title_) + "</h1>\n<p class=\"summary\">" +
         marked_up(summary_) + "</p>\n<nav>" + nav + "</nav></header>\n<main>\n" + body_ +
         (sections_.empty() ? "" : "</section>\n") + "</main>\n</body>\n</html>\n";
}

}  // namespace emtb
