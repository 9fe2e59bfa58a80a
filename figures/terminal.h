#pragma once

#include <cstddef>
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

/// [columns] in which prose is broken on standard output: those of its style.
std::size_t width_of_prose();

/// [columns] in which a row of a table, or one line of a list, is broken on standard output: those of the terminal.
/// Where it is piped a row stays whole, for grep and awk.
std::size_t width_of_rows();

}  // namespace emtb
