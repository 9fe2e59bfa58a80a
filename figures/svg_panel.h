#pragma once

#include "figures/svg_canvas.h"
#include "figures/svg_layout.h"

namespace emtb::svg {

/// Draws one panel: its words above, axes, data, words beside the data.
/// @param top [px] where its axes begin
void draw_panel(Canvas& canvas, const Layout& layout, std::size_t panel, double top);

}  // namespace emtb::svg
