#pragma once

#include <optional>
#include <string>
#include <vector>

#include "figures/figure.h"
#include "figures/scale.h"

namespace emtb::svg {

inline constexpr double title_size = 14;     ///< [px]
inline constexpr double line_height = 17;    ///< [px]
inline constexpr double tick_length = 4;     ///< [px]
inline constexpr double gap = 12;            ///< [px] between panels
inline constexpr double edge = 10;           ///< [px] around everything
inline constexpr double legend_sample = 22;  ///< [px]

/// Where everything of a figure has its place. Found before anything is drawn, for the panels get what the words leave.
class Layout {
 public:
  explicit Layout(const Figure& figure);

  const Figure& figure() const { return figure_; }
  double x_of(double value) const { return width_ * x_->share(value); }  ///< [px] from the left end of the panels
  const Scale& x() const { return *x_; }
  const Scale& y(std::size_t panel) const { return y_[panel]; }

  double left() const { return left_; }                                         ///< [px] of the panels
  double width() const { return width_; }                                       ///< [px] of the panels
  double top() const { return top_; }                                           ///< [px] below the title
  double height() const { return height_; }                                     ///< [px] of the figure
  double head_height(std::size_t panel) const { return heads_[panel]; }         ///< [px] of the words above it
  bool named_at_ends(std::size_t panel) const { return at_ends_[panel] != 0; }  ///< its traces, not in a legend
  std::size_t x_lines() const { return x_lines_; }                              ///< that the words below x take

  /// The panel's traces with a name that neither they nor a panel above have shown in the same ink.
  std::vector<const Trace*> named(std::size_t panel) const;

  /// The words above a panel: what y is, then the legend, in as many lines as it takes.
  struct Entry {
    const Trace* trace;
    double x, y;
  };
  std::vector<Entry> legend(std::size_t panel) const;

  /// The title in lines that fit the figure.
  std::vector<std::string> title_lines() const;

  /// A category's name in lines that fit its place.
  std::vector<std::string> wrapped(const std::string& name) const;

 private:
  void find_y();
  void find_sides();
  void find_x();
  void find_heights();
  Range with_room_for_labels(Range range, const Axis& axis) const;
  bool ends_apart(std::size_t panel) const;
  double needed_head(std::size_t panel) const;

  const Figure& figure_;
  std::vector<Scale> y_;
  std::optional<Scale> x_;
  std::vector<char> at_ends_;
  std::vector<double> heads_;
  std::size_t x_lines_ = 1;
  double left_ = 0, right_ = 0, top_ = 0, width_ = 0, height_ = 0;
};

}  // namespace emtb::svg
