#include "canvas.h"

#include <cairo-ft.h>
#include <cairo-pdf.h>
#include <cairo-svg.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <regex>
#include <vector>

#include "embedded_assets.h"
#include "errors.h"

namespace anticrack {

namespace {

/// The bundled font. Cairo keeps what it needs of it in a cache of its own, so it lives as long as the
/// process.
cairo_font_face_t* bundled_font() {
  static cairo_font_face_t* const font = [] {
    const std::string_view bytes = embedded_font();
    FT_Library library = nullptr;
    FT_Face face = nullptr;
    if (FT_Init_FreeType(&library) != 0 ||
        FT_New_Memory_Face(library, reinterpret_cast<const FT_Byte*>(bytes.data()), FT_Long(bytes.size()), 0,
                           &face) != 0) {
      throw InputError("the bundled font cannot be read by FreeType");
    }
    return cairo_ft_font_face_create_for_ft_face(face, FT_LOAD_NO_HINTING);
  }();
  return font;
}

/// A run of text at one height.
struct Run {
  std::string text;
  double scale = 1;  ///< of the size
  double rise = 0;   ///< in sizes, upwards
};

std::vector<Run> parse_markup(std::string_view text) {
  std::vector<Run> runs{{}};
  const auto take_character = [&](std::size_t& i, std::string& to) {
    do to += text[i++];
    while (i < text.size() && (text[i] & 0xC0) == 0x80);
  };
  for (std::size_t i = 0; i < text.size();) {
    const char c = text[i];
    if ((c == '_' || c == '^') && i + 1 < text.size()) {
      Run run{"", 0.7, c == '_' ? -0.18 : 0.38};
      ++i;
      if (text[i] == '{') {
        for (++i; i < text.size() && text[i] != '}';) take_character(i, run.text);
        ++i;
      } else {
        take_character(i, run.text);
      }
      runs.push_back(run);
      runs.emplace_back();
    } else {
      if (c == '\\' && i + 1 < text.size()) ++i;
      take_character(i, runs.back().text);
    }
  }
  return runs;
}

cairo_status_t append_bytes(void* closure, const unsigned char* data, unsigned length) {
  static_cast<std::string*>(closure)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

struct Canvas::State {
  DocumentFormat format = DocumentFormat::png;
  std::string bytes;
  cairo_surface_t* surface = nullptr;
  cairo_t* cairo = nullptr;

  void begin() {
    cairo = cairo_create(surface);
    cairo_font_options_t* options = cairo_font_options_create();
    cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
    cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
    cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
    cairo_set_font_options(cairo, options);
    cairo_font_options_destroy(options);
    cairo_set_font_face(cairo, bundled_font());
    cairo_set_source_rgb(cairo, 1, 1, 1);
    cairo_paint(cairo);
  }
  ~State() {
    cairo_destroy(cairo);
    cairo_surface_destroy(surface);
  }
  void color(const Color& c) { cairo_set_source_rgb(cairo, c[0], c[1], c[2]); }
};

DocumentFormat document_format(std::string_view file) {
  const auto ends = [&](std::string_view extension) { return file.ends_with(extension); };
  if (ends(".png")) return DocumentFormat::png;
  if (ends(".svg")) return DocumentFormat::svg;
  if (ends(".pdf")) return DocumentFormat::pdf;
  throw InputError(std::string(file) + ": expected a name that ends in .png, .svg or .pdf");
}

Canvas::Canvas(int width, int height) : Canvas(double(width), double(height), DocumentFormat::png) {}

Canvas::Canvas(double width, double height, DocumentFormat format) : state_(std::make_unique<State>()) {
  state_->format = format;
  switch (format) {
    case DocumentFormat::png:
      state_->surface = cairo_image_surface_create(CAIRO_FORMAT_RGB24, int(width), int(height));
      break;
    case DocumentFormat::svg:
      state_->surface = cairo_svg_surface_create_for_stream(append_bytes, &state_->bytes, width, height);
      cairo_svg_surface_set_document_unit(state_->surface, CAIRO_SVG_UNIT_PX);
      break;
    case DocumentFormat::pdf:
      state_->surface = cairo_pdf_surface_create_for_stream(append_bytes, &state_->bytes, width, height);
      // Cairo writes the present time unless it is given another: equal plots are equal files.
      cairo_pdf_surface_set_metadata(state_->surface, CAIRO_PDF_METADATA_CREATE_DATE, "2000-01-01T00:00:00Z");
      break;
  }
  if (cairo_surface_status(state_->surface) != CAIRO_STATUS_SUCCESS) {
    throw InputError("cannot make a picture of " + std::to_string(int(width)) + " x " +
                     std::to_string(int(height)) +
                     " pixels; expected at most 32767 along each side (Cairo: " +
                     cairo_status_to_string(cairo_surface_status(state_->surface)) + ")");
  }
  state_->begin();
}

Canvas::~Canvas() = default;

TextSize Canvas::measure(std::string_view text, double size) const {
  double width = 0;
  for (const Run& run : parse_markup(text)) {
    cairo_text_extents_t extents;
    cairo_set_font_size(state_->cairo, run.scale * size);
    cairo_text_extents(state_->cairo, run.text.c_str(), &extents);
    width += extents.x_advance;
  }
  // The box of the whole font, not of this ink: lines of different words keep one rhythm.
  return {width, 0.78 * size, 0.24 * size};
}

void Canvas::text(double x, double baseline, std::string_view text, double size, double align, Color color) {
  state_->color(color);
  x -= align * measure(text, size).width;
  for (const Run& run : parse_markup(text)) {
    cairo_text_extents_t extents;
    cairo_set_font_size(state_->cairo, run.scale * size);
    cairo_text_extents(state_->cairo, run.text.c_str(), &extents);
    cairo_move_to(state_->cairo, x, baseline - run.rise * size);
    cairo_show_text(state_->cairo, run.text.c_str());
    x += extents.x_advance;
  }
}

void Canvas::vertical_text(double x, double y, std::string_view text, double size, Color color) {
  cairo_save(state_->cairo);
  cairo_translate(state_->cairo, x, y);
  cairo_rotate(state_->cairo, -std::acos(0.0));
  this->text(0, 0, text, size, 0.5, color);
  cairo_restore(state_->cairo);
}

void Canvas::line(double x0, double y0, double x1, double y1, double width, Color color) {
  const std::array<double, 2> points[] = {{x0, y0}, {x1, y1}};
  polyline(points, width, color);
}

void Canvas::polyline(std::span<const std::array<double, 2>> points, double width, Color color) {
  if (points.empty()) return;
  state_->color(color);
  cairo_set_line_width(state_->cairo, width);
  cairo_set_line_join(state_->cairo, CAIRO_LINE_JOIN_ROUND);
  cairo_move_to(state_->cairo, points[0][0], points[0][1]);
  for (const auto& p : points.subspan(1)) cairo_line_to(state_->cairo, p[0], p[1]);
  cairo_stroke(state_->cairo);
}

void Canvas::disc(double x, double y, double radius, Color color) {
  state_->color(color);
  cairo_arc(state_->cairo, x, y, radius, 0, 2 * std::numbers::pi);
  cairo_fill(state_->cairo);
}

void Canvas::fill(double x, double y, double width, double height, Color color) {
  state_->color(color);
  cairo_rectangle(state_->cairo, x, y, width, height);
  cairo_fill(state_->cairo);
}

void Canvas::frame(double x, double y, double width, double height, double line_width, Color color) {
  state_->color(color);
  cairo_set_line_width(state_->cairo, line_width);
  cairo_set_line_join(state_->cairo, CAIRO_LINE_JOIN_MITER);
  cairo_rectangle(state_->cairo, x, y, width, height);
  cairo_stroke(state_->cairo);
}

void Canvas::picture(int x, int y, const Image& image) {
  const int stride = cairo_format_stride_for_width(CAIRO_FORMAT_RGB24, image.width);
  std::vector<unsigned char> rows(std::size_t(stride) * std::size_t(image.height));
  for (int row = 0; row < image.height; ++row) {
    auto* to = reinterpret_cast<std::uint32_t*>(rows.data() + std::size_t(row) * std::size_t(stride));
    for (int column = 0; column < image.width; ++column) {
      const Rgb8& c = image.at(column, row);
      to[column] = std::uint32_t(c[0]) << 16 | std::uint32_t(c[1]) << 8 | c[2];
    }
  }
  cairo_surface_t* source =
      cairo_image_surface_create_for_data(rows.data(), CAIRO_FORMAT_RGB24, image.width, image.height, stride);
  cairo_set_source_surface(state_->cairo, source, x, y);
  cairo_paint(state_->cairo);
  cairo_set_source_rgb(state_->cairo, 0, 0, 0);
  cairo_surface_finish(source);
  cairo_surface_destroy(source);
}

void Canvas::clipped(double x, double y, double width, double height, const std::function<void()>& draw) {
  cairo_save(state_->cairo);
  cairo_rectangle(state_->cairo, x, y, width, height);
  cairo_clip(state_->cairo);
  draw();
  cairo_restore(state_->cairo);
}

Image Canvas::image() const {
  cairo_surface_flush(state_->surface);
  Image image(cairo_image_surface_get_width(state_->surface),
              cairo_image_surface_get_height(state_->surface));
  const unsigned char* data = cairo_image_surface_get_data(state_->surface);
  const int stride = cairo_image_surface_get_stride(state_->surface);
  for (int row = 0; row < image.height; ++row) {
    const auto* from = reinterpret_cast<const std::uint32_t*>(data + std::size_t(row) * std::size_t(stride));
    for (int column = 0; column < image.width; ++column) {
      const std::uint32_t c = from[column];
      image.at(column, row) = {std::uint8_t(c >> 16), std::uint8_t(c >> 8), std::uint8_t(c)};
    }
  }
  return image;
}

std::string Canvas::document(const TextChunks& text) {
  if (state_->format == DocumentFormat::png) return encode_png(image(), text);
  cairo_surface_finish(state_->surface);
  if (state_->format == DocumentFormat::svg) {
    // Cairo numbers its surfaces over the whole process: equal plots are equal files.
    return std::regex_replace(state_->bytes, std::regex("id=\"surface[0-9]+\""), "id=\"surface\"");
  }
  return state_->bytes;
}

std::string plain_text(std::string_view text) {
  std::string plain;
  for (const char c : text) {
    if (c == '_' || c == '^' || c == '\\') plain += '\\';
    plain += c;
  }
  return plain;
}

}  // namespace anticrack
