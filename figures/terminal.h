#pragma once

#include <string>

#include "figures/figure.h"

namespace emtb {

/// How a figure is drawn in a terminal.
struct TerminalStyle {
  int width = 80;       ///< [columns] in all
  int lines = 12;       ///< of a panel of 200 px; others in proportion, three at the least
  bool colour = false;  ///< inks as ANSI colours; else told apart by the legend's order alone
};

/// The figure's curves, points and bands' edges in braille dots (two by four a character), with axes and a legend.
/// Bars are not drawn: a table says as much.
std::string to_terminal(const Figure& figure, const TerminalStyle& style = {});

/// What suits standard output: the terminal's width and colours, or 80 plain columns where it is piped.
TerminalStyle style_of_stdout();

}  // namespace emtb
