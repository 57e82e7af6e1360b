#include "annotation.h"

#include <gtest/gtest.h>

#include "errors.h"
#include "expect_error.h"
#include "panel.h"
#include "ticks.h"

namespace anticrack {
namespace {

Annotation example() {
  Annotation annotation;
  annotation.scale.map = &ColorMap::strain();
  annotation.scale.high = 1.5;
  annotation.scale.clipped_high = true;
  annotation.quantity = "accumulated plastic strain \u03ba";
  annotation.state = "\u03b5_y = \u221211.0 %";
  annotation.title = "\u03c6 = 0.34";
  return annotation;
}

TEST(Annotation, NothingOverlapsAtAnySize) {
  for (const auto& [width, height] :
       {std::pair{240, 320}, {480, 360}, {1080, 1440}, {1920, 1080}, {3000, 4000}}) {
    const AnnotationLayout l = layout_annotation(width, height, example());
    const Rectangle items[] = {l.picture, l.title, l.state, l.scale_bar, l.color_bar, l.quantity};
    for (std::size_t a = 0; a < std::size(items); ++a) {
      EXPECT_GE(items[a].x, 0);
      EXPECT_GE(items[a].y, 0);
      EXPECT_LE(items[a].x + items[a].width, width);
      EXPECT_LE(items[a].y + items[a].height, height);
      for (std::size_t b = 0; b < a; ++b)
        EXPECT_FALSE(items[a].overlaps(items[b])) << a << ' ' << b << ' ' << width;
    }
    EXPECT_GT(l.picture.height, 0.7 * height);
  }
}

TEST(Annotation, ColourBarRunsOverTheWholeMap) {
  const Annotation annotation = example();
  const AnnotationLayout l = layout_annotation(600, 800, annotation);
  const Image image =
      annotate(600, 800, Image(int(l.picture.width), int(l.picture.height)), 1e-3, annotation);
  const int middle = int(l.bar.y + l.bar.height / 2);
  const int first = int(l.bar.x);
  const int last = int(l.bar.x + l.bar.width) - 1;
  EXPECT_EQ(image.at(first, middle), ColorMap::strain().rgb(0));
  EXPECT_EQ(image.at(last, middle), ColorMap::strain().rgb(1));
  EXPECT_EQ(image.at((first + last) / 2, middle),
            ColorMap::strain().rgb(((first + last) / 2 - first) / double(last - first)));
}

TEST(Annotation, LeavesThePictureAsItIs) {
  const Annotation annotation = example();
  const AnnotationLayout l = layout_annotation(600, 800, annotation);
  Image picture(int(l.picture.width), int(l.picture.height));
  for (int row = 0; row < picture.height; ++row) {
    for (int column = 0; column < picture.width; ++column) {
      picture.at(column, row) = {std::uint8_t(column), std::uint8_t(row), 77};
    }
  }
  const Image image = annotate(600, 800, picture, 1e-3, annotation);
  for (int row = 0; row < picture.height; ++row) {
    for (int column = 0; column < picture.width; ++column) {
      ASSERT_EQ(image.at(column, row + int(l.picture.y)), picture.at(column, row));
    }
  }
}

TEST(Annotation, ScaleBarIsAsLongAsItSays) {
  const Annotation annotation = example();
  const AnnotationLayout l = layout_annotation(600, 800, annotation);
  const double pixel_size = 3.1e-3;
  const Image image =
      annotate(600, 800, Image(int(l.picture.width), int(l.picture.height)), pixel_size, annotation);
  const int row = int(l.bar.y + l.bar.height / 2);
  int dark = 0;
  for (int column = 0; column < int(l.bar.x) - 4; ++column) dark += image.at(column, row)[0] < 128;
  const double length = round_length(l.bar_length_limit * pixel_size);
  EXPECT_NEAR(dark * pixel_size, length, 1.01 * pixel_size);  // a pixel
}

TEST(Annotation, RefusesAPictureWithoutRoom) {
  EXPECT_ERROR(layout_annotation(60, 40, example()), InputError, "picture of 60 x 40 pixels leaves no room");
}

TEST(Annotation, LengthsAreRound) {
  EXPECT_DOUBLE_EQ(round_length(0.37), 0.2);
  EXPECT_DOUBLE_EQ(round_length(0.5), 0.5);
  EXPECT_DOUBLE_EQ(round_length(0.99), 0.5);
  EXPECT_DOUBLE_EQ(round_length(1000), 1000);
  EXPECT_EQ(length_label(0.2), "20 cm");
  EXPECT_EQ(length_label(5e-3), "5 mm");
  EXPECT_EQ(length_label(2e-5), "20 \u00b5m");
  EXPECT_EQ(length_label(2), "2 m");
}

TEST(Ticks, AreRoundAndInside) {
  const Ticks ticks = linear_ticks(0.03, 1.52, 5);
  EXPECT_EQ(ticks.labels, (std::vector<std::string>{"0.2", "0.4", "0.6", "0.8", "1.0", "1.2", "1.4"}));
  EXPECT_EQ(linear_ticks(-2, 2, 4).labels, (std::vector<std::string>{"\u22122", "\u22121", "0", "1", "2"}));
  const Ticks small = linear_ticks(0, 3e-5, 3);
  EXPECT_EQ(small.exponent, -6);
  EXPECT_EQ(small.labels, (std::vector<std::string>{"0", "10", "20", "30"}));
  EXPECT_EQ(logarithmic_ticks(0.02, 30).labels, (std::vector<std::string>{"0.1", "1", "10"}));
  EXPECT_EQ(number_label(1.5e-7), "1.5\u00d710^{\u22127}");
  EXPECT_EQ(number_label(-0.25), "\u22120.25");
}

TEST(Canvas, MarkupTakesNoRoomAndPlainTextKeepsItsCharacters) {
  const Canvas canvas(10, 10);
  const double x = canvas.measure("x", 20).width;
  EXPECT_NEAR(canvas.measure("x_{x}", 20).width, 1.7 * x, 1e-6);
  EXPECT_NEAR(canvas.measure("x^xx", 20).width, 2.7 * x, 1e-6);
  EXPECT_EQ(plain_text("run_1^2"), "run\\_1\\^2");
  const double underscore = canvas.measure(plain_text("_"), 20).width;
  EXPECT_NEAR(canvas.measure(plain_text("x_x"), 20).width, 2 * x + underscore, 1e-6);
}

TEST(Canvas, LargerThanCairoDrawsIsRefusedByItsSize) {
  EXPECT_ERROR(Canvas(40000, 10), InputError,
               "cannot make a picture of 40000 x 10 pixels; expected at most 32767 along each side");
}

TEST(Panel, LaysRowsAndColumnsWithoutOverlap) {
  Panel panel{{"a", "b with a very long title indeed, which must shrink", "c"},
              {"\u03b5 = 1", "\u03b5 = 2"},
              example()};
  const PanelLayout l = layout_panel(panel, 180, 300);
  ASSERT_EQ(l.pictures.size(), 6u);
  EXPECT_GT(l.width, 3 * 180);
  EXPECT_GT(l.height, 2 * 300);
  std::vector<Rectangle> items = l.pictures;
  items.insert(items.end(), {l.strip.scale_bar, l.strip.color_bar, l.strip.quantity});
  for (std::size_t a = 0; a < items.size(); ++a) {
    EXPECT_LE(items[a].x + items[a].width, l.width);
    EXPECT_LE(items[a].y + items[a].height, l.height);
    for (std::size_t b = 0; b < a; ++b) EXPECT_FALSE(items[a].overlaps(items[b])) << a << ' ' << b;
  }
  EXPECT_LT(l.pictures[0].x, l.pictures[1].x);
  EXPECT_LT(l.pictures[0].y, l.pictures[3].y);
}

TEST(Panel, ShowsEachPictureInItsPlace) {
  Panel panel{{"a", "b"}, {"1", "2"}, example()};
  std::vector<Image> pictures;
  for (int i = 0; i < 4; ++i) pictures.emplace_back(120, 200, Rgb8{std::uint8_t(50 * i), 90, 10});
  const PanelLayout l = layout_panel(panel, 120, 200);
  const Image image = compose_panel(panel, pictures, 1e-3);
  EXPECT_EQ(image.width, l.width);
  EXPECT_EQ(image.height, l.height);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(image.at(int(l.pictures[i].x) + 60, int(l.pictures[i].y) + 100), pictures[i].at(60, 100));
  }
}

TEST(Panel, RefusesWhatDoesNotFit) {
  Panel panel{{"a", "b"}, {"1"}, example()};
  EXPECT_ERROR(compose_panel(panel, {Image(9, 9)}, 1), InputError, "panel: got 1 pictures; expected 2");
  EXPECT_ERROR(compose_panel(panel, {Image(90, 90), Image(90, 91)}, 1), InputError,
               "panel: pictures differ in size; expected one size");
  EXPECT_ERROR(layout_panel({{}, {"1"}, example()}, 100, 100), InputError,
               "panel: expected at least one column and one row");
}

}  // namespace
}  // namespace anticrack
