#pragma once

#include <array>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "image.h"

namespace anticrack {

enum class DocumentFormat { png, svg, pdf };

/// By the file's extension. @throws InputError  naming the three
DocumentFormat document_format(std::string_view file);

struct TextSize {
  double width, ascent, descent;  ///< [pixels]
};

/// A drawing surface (Cairo) with the bundled font. Pixels, y downwards.
///
/// Text carries a little markup: `_x`, `_{xyz}` lower and `^x`, `^{xyz}` raise what follows; a backslash
/// takes the meaning away.
class Canvas {
 public:
  using Color = std::array<double, 3>;  ///< sRGB in [0, 1]
  static constexpr Color ink{0.13, 0.13, 0.13};
  static constexpr Color faint{0.80, 0.80, 0.80};

  Canvas(int width, int height);                               ///< white raster
  Canvas(double width, double height, DocumentFormat format);  ///< png: white raster
  ~Canvas();
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  TextSize measure(std::string_view text, double size) const;
  /// @param align  part of the width that lies left of x: 0 left, 0.5 centred, 1 right
  void text(double x, double baseline, std::string_view text, double size, double align = 0,
            Color color = ink);
  /// Reads upwards; centred about (x of the baseline, y).
  void vertical_text(double x, double y, std::string_view text, double size, Color color = ink);
  void line(double x0, double y0, double x1, double y1, double width, Color color = ink);
  void polyline(std::span<const std::array<double, 2>> points, double width, Color color);
  void disc(double x, double y, double radius, Color color);
  void fill(double x, double y, double width, double height, Color color);
  void frame(double x, double y, double width, double height, double line_width, Color color = ink);
  void picture(int x, int y, const Image& image);
  void clipped(double x, double y, double width, double height, const std::function<void()>& draw);

  Image image() const;                                ///< of a raster
  std::string document(const TextChunks& text = {});  ///< bytes of the file, no date; ends the drawing

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// `text` with its markup characters made plain, for names that users choose.
std::string plain_text(std::string_view text);

}  // namespace anticrack
