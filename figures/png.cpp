#include <librsvg/rsvg.h>

#include <cmath>
#include <memory>

#include "figures/figure.h"
#include "hal/error.h"

namespace emtb {

void write_png(const Figure& figure, const std::filesystem::path& path, double scale) {
  const std::string svg = to_svg(figure, Theme::standalone);
  GError* error = nullptr;
  const std::unique_ptr<RsvgHandle, decltype(&g_object_unref)> handle(
      rsvg_handle_new_from_data(reinterpret_cast<const guint8*>(svg.data()), svg.size(), &error), g_object_unref);
  const auto fail = [&](const std::string& why) {
    if (error != nullptr) g_error_free(error);
    throw Error(path.string() + ": " + why);
  };
  if (!handle) fail("the figure cannot be drawn: " + std::string(error->message));
  double width = 0, height = 0;
  rsvg_handle_get_intrinsic_size_in_pixels(handle.get(), &width, &height);
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(std::lround(width * scale)),
                                 static_cast<int>(std::lround(height * scale))),
      cairo_surface_destroy);
  const std::unique_ptr<cairo_t, decltype(&cairo_destroy)> picture(cairo_create(surface.get()), cairo_destroy);
  const RsvgRectangle whole{0, 0, std::round(width * scale), std::round(height * scale)};
  if (rsvg_handle_render_document(handle.get(), picture.get(), &whole, &error) == 0)
    fail("the figure cannot be drawn: " + std::string(error->message));
  const cairo_status_t status = cairo_surface_write_to_png(surface.get(), path.c_str());
  if (status != CAIRO_STATUS_SUCCESS) {
    fail("cannot be written (" + std::string(cairo_status_to_string(status)) +
         "). Give a file in a folder that exists");
  }
}

}  // namespace emtb
