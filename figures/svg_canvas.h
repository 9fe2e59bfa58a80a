#pragma once

#include <array>
#include <string>

#include "figures/figure.h"
#include "figures/scale.h"

namespace emtb::svg {

inline constexpr double text_size = 12;  ///< [px]
inline constexpr const char* font = "'Helvetica Neue',Helvetica,Arial,'Liberation Sans',sans-serif";

/// A colour on white and on dark, by the name of its CSS class.
struct Colour {
  const char* name;
  const char* light;
  const char* dark;
};

// Okabe and Ito's, orange and sky a little darker where they lie on white.
inline constexpr std::array<Colour, 8> inks{{{"grey", "#767676", "#9a9a9a"},
                                             {"vermilion", "#d55e00", "#ff8b45"},
                                             {"blue", "#0072b2", "#4fb0f0"},
                                             {"green", "#009e73", "#35c99b"},
                                             {"orange", "#d08a00", "#f2b33d"},
                                             {"purple", "#b8609a", "#e39ac8"},
                                             {"sky", "#3d9fd8", "#93d2f5"},
                                             {"ink", "#1f1f1f", "#e6e6e6"}}};
inline constexpr Colour paper{"paper", "#ffffff", "#16181c"};
inline constexpr Colour words{"words", "#1f1f1f", "#e6e6e6"};
inline constexpr Colour faint_words{"faint", "#5a5a5a", "#a5a8ad"};
inline constexpr Colour grid{"grid", "#e4e4e4", "#2d3138"};
inline constexpr Colour frame{"frame", "#6b6b6b", "#8a8f98"};
inline constexpr Colour shadow{"shade", "#f0f0ee", "#22252b"};

const Colour& colour_of(Ink ink);
const char* dashes(const Pen& pen);  ///< as stroke-dasharray has them; empty: solid

/// A length to a tenth of a pixel, as short as it can be written, the same on every machine.
std::string px(double value);

/// How wide a text is [px], near enough for Helvetica and its metric equals.
double width_of(const std::string& marked, double size = text_size);

/// Writes elements in the colours of a theme.
class Canvas {
 public:
  struct Font {
    const Colour* colour = &words;
    const char* anchor = "start";
    double size = text_size;
    bool bold = false;
    bool halo = false;  ///< on a rim of paper, to be read over lines
  };

  explicit Canvas(Theme theme) : theme_(theme) {}

  Theme theme() const { return theme_; }

  void raw(const std::string& text) { svg_ += text; }
  void line(double x1, double y1, double x2, double y2, const Colour& colour, double width = 1, const char* dash = "");
  void rectangle(double x, double y, double width, double height, const Colour& colour, double opacity = 1);
  void text(double x, double y, const std::string& marked, const Font& how);

  /// A curve through pixels, broken where they are NaN.
  void curve(const Pixels& p, const Pen& pen);
  void area(const Pixels& above, const Pixels& below, const Colour& colour, double opacity);
  void marker(double x, double y, const Pen& pen);

  std::string take() { return std::move(svg_); }

 private:
  std::string stroke(const Colour& colour, double width, const char* dash) const;
  std::string fill(const Colour& colour, double opacity) const;

  Theme theme_;
  std::string svg_;
};

}  // namespace emtb::svg
