#pragma once

#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace emtb {

/// Figures described as data, drawn as SVG, as PNG or in the terminal (figures/terminal.h).
///
///     Figure figure("A step to 4 V", "Measured and simulated speed, and what is between them");
///     figure.x({"t", "s"});
///     figure.panel({"ω", "rad/s"}).line("measured", t, omega, {Ink::grey}).line("model", t, simulated, {Ink::blue});
///     figure.panel({"residual", "rad/s"}, 90).band("noise floor", t, low, high).line("", t, residual, {Ink::blue});
///     write_png(figure, "step.png");
///
/// Panels stand under each other and share x. Ranges and ticks find themselves; readings that are not finite are gaps.
/// In every text `i_{a}` sets the a as a subscript. The same figure gives the same bytes on every machine.

/// Colours that colour-blind eyes tell apart (Okabe and Ito 2008), each with a dash and a marker of its own, so that a
/// grey print does as well.
enum class Ink { grey, vermilion, blue, green, orange, purple, sky, ink };
enum class Dash { of_ink, solid, dashed, dotted, dash_dot };
enum class Marker { of_ink, none, circle, square, triangle, diamond, cross };

/// How a trace is drawn.
struct Pen {
  Ink ink = Ink::ink;
  double width = 1.5;  ///< [px] of lines
  Dash dash = Dash::of_ink;
  Marker marker = Marker::of_ink;
  double size = 3;  ///< [px] half the size of a marker
};

/// An axis: what it shows, in which unit, and, where it is not to find itself, from where to where.
struct Axis {
  std::string label;
  std::string unit = {};                     ///< empty: none is written
  bool log = false;                          ///< logarithmic; values that are not positive are gaps
  std::optional<double> min = {}, max = {};  ///< ends of the axis; absent: whatever holds all data
  bool with_zero = false;                    ///< the range holds zero (one, where logarithmic)
  std::vector<std::string> categories = {};  ///< names of the places 0, 1, 2 ...; not empty: an axis of names
};

/// One series of a panel.
struct Trace {
  enum class Kind { line, steps, points, band, bars, horizontal_bars };
  Kind kind = Kind::line;
  std::string name;                 ///< in the legend; empty: not in it
  std::vector<double> x, y;         ///< as long as each other
  std::vector<double> low, high;    ///< ends of the error bars in y, or of the band; else empty
  std::vector<double> left, right;  ///< ends of the error bars in x; else empty
  std::vector<std::string> labels;  ///< beside each point or at each bar's end; else empty
  Pen pen;
};

/// A line across a panel at a value: the noise floor, the final error.
struct Reference {
  double at = 0;
  std::string label;
  bool vertical = false;
  Pen pen{Ink::grey, 1, Dash::dashed};
};

/// A stretch of x with a shaded background.
struct Shade {
  double from = 0, to = 0;
  std::string label;
};

/// Words at a place among the data.
struct Note {
  double x = 0, y = 0;
  std::string text;
};

/// One pair of axes with what is drawn in it. Each call returns the panel, to go on.
class Panel {
 public:
  Panel(Axis y, double pixels) : y_axis(std::move(y)), height(pixels) {}

  Panel& line(std::string name, std::vector<double> x, std::vector<double> y, Pen pen = {});
  Panel& steps(std::string name, std::vector<double> x, std::vector<double> y, Pen pen = {});  ///< held to the next x
  Panel& points(std::string name, std::vector<double> x, std::vector<double> y, Pen pen = {});
  Panel& points_with_errors(std::string name, std::vector<double> x, std::vector<double> y, std::vector<double> low,
                            std::vector<double> high, Pen pen = {});
  /// Intervals along x, as of a forest plot.
  Panel& intervals(std::string name, std::vector<double> x, std::vector<double> y, std::vector<double> left,
                   std::vector<double> right, Pen pen = {});
  Panel& band(std::string name, std::vector<double> x, std::vector<double> low, std::vector<double> high,
              Pen pen = {Ink::grey});
  Panel& bars(std::string name, std::vector<double> x, std::vector<double> y, Pen pen = {Ink::blue});
  /// Bars of lengths `x` at the places `y`; the first place is the uppermost where the axis has names.
  Panel& horizontal_bars(std::string name, std::vector<double> x, std::vector<double> y, Pen pen = {Ink::blue});
  Panel& labels(std::vector<std::string> of_the_last_trace);
  Panel& reference(double y, std::string label, Pen pen = {Ink::grey, 1, Dash::dashed});
  Panel& vertical_reference(double x, std::string label, Pen pen = {Ink::grey, 1, Dash::dashed});
  Panel& shade(double from, double to, std::string label = {});
  Panel& note(double x, double y, std::string text);

  Axis y_axis;
  double height;  ///< [px] of the plot itself
  std::vector<Trace> traces;
  std::vector<Reference> references;
  std::vector<Shade> shades;
  std::vector<Note> notes;
};

class Figure {
 public:
  /// @param about what it shows, for those who cannot see it
  explicit Figure(std::string heading = {}, std::string about = {})
      : title(std::move(heading)), description(std::move(about)) {}

  Figure& x(Axis axis);
  Figure& wide(double pixels);

  /// A panel below the others. It stays where it is when more are added.
  Panel& panel(Axis y, double height = 200);

  std::string title, description;
  Axis x_axis;
  double width = 820;  ///< [px] in all
  std::deque<Panel> panels;
};

/// Whose colours an SVG has: the page's, by CSS classes (see svg_style()), or its own on white.
enum class Theme { page, standalone };

/// The figure as an SVG element. Lines of 10^5 points are thinned to what a screen can show: the first, smallest,
/// largest and last of each pixel column, so that no peak is lost.
std::string to_svg(const Figure& figure, Theme theme = Theme::standalone);

/// The style sheet for figures of Theme::page: light, dark where the reader's system is dark, light in print.
std::string svg_style();

/// @throws Error where the file cannot be written.
void write_svg(const Figure& figure, const std::filesystem::path& path);

/// Draws the stand-alone SVG with librsvg.
/// @param scale pixels of the picture a pixel of the figure
/// @throws Error where the file cannot be written or the picture not be drawn.
void write_png(const Figure& figure, const std::filesystem::path& path, double scale = 2);

}  // namespace emtb
