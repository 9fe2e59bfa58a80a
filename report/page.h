#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "figures/figure.h"

namespace emtb {

/// A figure of a page, with the name of the file it gets on its own.
struct NamedFigure {
  std::string name;  ///< `residual_omega_against_i_a`
  Figure figure;
  std::string caption;  ///< what to see in it
};

/// One HTML page that needs nothing but itself: no script, no network, no other file. Light or dark as the reader's
/// system is, on a phone, and on A4 with a page break before each section.
///
/// In every text `i_{a}` is a subscript and `backticks` hold code; all else is shown as it is.
class Page {
 public:
  /// @param summary   a line under the title
  /// @param on_figure called with each figure as it is added, e.g. to write it as a picture too
  Page(std::string title, std::string summary, std::function<void(const NamedFigure&)> on_figure = {});

  Page& section(const std::string& heading, bool on_new_page = true);  ///< a new page in print, but for short ones
  Page& subsection(const std::string& heading);
  Page& paragraph(const std::string& text);
  Page& lead(const std::string& text);  ///< a paragraph that must not be overlooked
  Page& list(const std::vector<std::string>& items);
  Page& code(const std::string& text);  ///< kept line by line

  /// What follows, up to end_fold(), is behind a heading to open; open in print.
  Page& fold(const std::string& heading, bool open = false);
  Page& end_fold();
  Page& folded(const std::string& heading, const std::string& text);  ///< code behind a heading to open

  /// Each a word and what it says: `What it is`, and what it is.
  Page& facts(const std::vector<std::pair<std::string, std::string>>& facts);

  /// @param columns `l` or `r` for each: how its cells are aligned
  /// @param rows    the first cell of each names the row
  Page& table(const std::string& caption, const std::string& columns, const std::vector<std::string>& heading,
              const std::vector<std::vector<std::string>>& rows);

  Page& figure(const NamedFigure& figure);  ///< on a phone as wide as that, not a small picture of a large one
  Page& side_by_side(const std::vector<NamedFigure>& figures);  ///< what the page is about; each with its caption
  Page& small_multiples(const std::vector<NamedFigure>& figures, const std::string& caption);  ///< beside each other

  std::string html() const;

 private:
  std::string title_, summary_, body_;
  std::vector<std::string> sections_;
  int folds_ = 0;  ///< that are not ended
  std::function<void(const NamedFigure&)> on_figure_;
};

}  // namespace emtb
