#include "plot.h"

#include <gtest/gtest.h>

#include <cmath>

#include "errors.h"
#include "expect_error.h"
#include "png_content.h"

namespace anticrack {
namespace {

Plot example() {
  Plot plot{"\u2212\u03b5_y [%]", "stress [MPa]", {}};
  for (const auto& [label, slope] : {std::pair{"p", 1.0}, {"q", 0.5}}) {
    Curve curve{label, {}, {}};
    for (int i = 0; i <= 100; ++i) {
      curve.x.push_back(0.1 * i);
      curve.y.push_back(slope * 0.1 * i);
    }
    plot.curves.push_back(curve);
  }
  return plot;
}

TEST(Plot, WritesPngSvgAndPdf) {
  EXPECT_EQ(draw_plot(example(), DocumentFormat::png).substr(1, 3), "PNG");
  EXPECT_NE(draw_plot(example(), DocumentFormat::svg).find("<svg"), std::string::npos);
  EXPECT_EQ(draw_plot(example(), DocumentFormat::pdf).substr(0, 5), "%PDF-");
}

TEST(Plot, IsTheSameBytesTwice) {
  for (const DocumentFormat format : {DocumentFormat::png, DocumentFormat::svg, DocumentFormat::pdf}) {
    EXPECT_EQ(draw_plot(example(), format), draw_plot(example(), format));
  }
}

TEST(Plot, FormatFollowsTheExtension) {
  EXPECT_EQ(document_format("a/b.svg"), DocumentFormat::svg);
  EXPECT_EQ(document_format("b.pdf"), DocumentFormat::pdf);
  EXPECT_EQ(document_format("b.png"), DocumentFormat::png);
  EXPECT_ERROR(document_format("b.jpg"), InputError,
               "b.jpg: expected a name that ends in .png, .svg or .pdf");
}

TEST(Plot, DrawsTheSteeperCurveAbove) {
  const Image image = decode_png(draw_plot(example(), DocumentFormat::png, 900, 600));
  EXPECT_EQ(image.width, 900);
  // Walk down a column three quarters along: first the black curve, then the blue one.
  int black = -1;
  int blue = -1;
  for (int row = 40; row < 500; ++row) {
    const Rgb8& c = image.at(650, row);
    if (black < 0 && c[0] < 60 && c[2] < 60) black = row;
    if (blue < 0 && c[2] > c[0] + 80) blue = row;
  }
  ASSERT_GE(black, 0);
  ASSERT_GE(blue, 0);
  EXPECT_LT(black + 50, blue);
}

TEST(Plot, OfNeighbouringDoublesComesToAnEnd) {
  const double next = std::nextafter(1e6, 2e6);
  EXPECT_NO_THROW(draw_plot({"x", "y", {{"", {0, 1, 2}, {1e6, next, 1e6}}}}, DocumentFormat::png));
}

TEST(Plot, BreaksTheLineWhereAValueIsMissing) {
  Plot plot{"x", "y", {{"", {0, 1, 2, 3}, {1, NAN, 2, 2}}}};
  EXPECT_NO_THROW(draw_plot(plot, DocumentFormat::png));
}

/// Row of the first pixel of a column that is clearly blue, the second curve's colour; -1 if there is none.
int first_blue(const Image& image, int column) {
  for (int row = 0; row < image.height; ++row) {
    const Rgb8& c = image.at(column, row);
    if (c[2] > c[0] + 80) return row;
  }
  return -1;
}

TEST(Plot, PowersAreStraightOnLogarithmicAxes) {
  Plot plot{"n", "error", {{"", {1, 100}, {1, 1}}, {"", {}, {}}}};
  plot.log_x = plot.log_y = true;
  for (double x = 1; x <= 100; x *= 1.05) {
    plot.curves[1].x.push_back(x);
    plot.curves[1].y.push_back(1 / (x * x));
  }
  const Image image = decode_png(draw_plot(plot, DocumentFormat::png, 900, 600));
  const int a = first_blue(image, 300), b = first_blue(image, 500), c = first_blue(image, 700);
  ASSERT_GT(a, 0);
  EXPECT_GT(b - a, 50);
  EXPECT_NEAR(c - b, b - a, 3);
}

TEST(Plot, AFailureStandsAtTheUpperEdge) {
  Plot plot{"s", "error", {{"", {1, 100}, {1, 1e-3}}, {"", {10}, {INFINITY}, {Marker::cross}}}};
  plot.log_x = plot.log_y = true;
  const Image image = decode_png(draw_plot(plot, DocumentFormat::png, 900, 600));
  int top = image.height;
  for (int column = 100; column < 880; ++column)
    if (const int row = first_blue(image, column); row >= 0) top = std::min(top, row);
  EXPECT_LT(top, 50);
}

TEST(Plot, MarksEveryPointAndTellsFilledFromHollow) {
  const auto with = [](Marker marker) {
    Plot plot{"x", "y", {{"", {0, 10}, {0, 10}}, {"", {5}, {2}, {marker}}}};
    const Image image = decode_png(draw_plot(plot, DocumentFormat::png, 900, 600));
    int blue = 0;
    for (int row = 0; row < image.height; ++row)
      for (int column = 0; column < image.width; ++column) {
        const Rgb8& c = image.at(column, row);
        blue += c[2] > c[0] + 80;
      }
    return blue;
  };
  EXPECT_EQ(with(Marker::none), 0);
  EXPECT_GT(with(Marker::hollow), 30);
  EXPECT_GT(with(Marker::filled), with(Marker::hollow) + 20);
}

TEST(Plot, MayStartAtZero) {
  // y = 100 ... 101: with the zero, the curve lies in the upper tenth of the frame, else all over it.
  Plot plot{"x", "y", {{"", {0, 1}, {100, 101}}}};
  const auto lowest_dark_row = [&] {
    const Image image = decode_png(draw_plot(plot, DocumentFormat::png, 900, 600));
    int lowest = 0;
    for (int row = 40; row < 500; ++row)
      for (int column = 200; column < 850; ++column)
        if (image.at(column, row)[0] < 60) lowest = row;
    return lowest;
  };
  EXPECT_GT(lowest_dark_row(), 350);
  plot.y_from_zero = true;
  EXPECT_LT(lowest_dark_row(), 100);
}

TEST(Page, FillsEachOfItsCells) {
  const Page page{"A page", {Table{{"solid fraction", "0.8"}, {"pores", "0.2"}}, example(), example()}, 2};
  const Image image = decode_png(draw_page(page, DocumentFormat::png, 1200));
  EXPECT_EQ(image.width, 1200);
  const int title = image.height - 2 * 432;  // cells are 600 wide and 432 high
  ASSERT_GT(title, 20);
  const auto dark = [&](int x, int y, int width, int height) {
    int count = 0;
    for (int row = y; row < y + height; ++row)
      for (int column = x; column < x + width; ++column) count += image.at(column, row)[0] < 100;
    return count;
  };
  EXPECT_GT(dark(0, 0, 600, title), 50);
  EXPECT_GT(dark(0, title, 600, 432), 50);
  EXPECT_GT(dark(600, title, 600, 432), 500);
  EXPECT_GT(dark(0, title + 432, 600, 432), 500);
  EXPECT_EQ(dark(600, title + 432, 600, 432), 0);
  EXPECT_ERROR(draw_page({"", {}, 2}, DocumentFormat::png), InputError, "page of 0 cells in 2 columns");
}

TEST(Plot, RefusesNothing) {
  EXPECT_ERROR(draw_plot({"x", "y", {}}, DocumentFormat::png), InputError,
               "nothing to plot: no curve has a finite point");
  EXPECT_ERROR(draw_plot({"x", "y", {{"", {NAN}, {1}}}}, DocumentFormat::png), InputError,
               "nothing to plot: no curve has a finite point");
  EXPECT_ERROR(draw_plot({"x", "y", {{"", {1, 2}, {1}}}}, DocumentFormat::png), InputError,
               "2 abscissas for 1 values; expected equally many");
  EXPECT_ERROR(draw_plot({"x", "y", {{"", {1, 2}, {1, 2}, {Marker::filled}}}}, DocumentFormat::png),
               InputError, "1 markers for 2 points; expected equally many or none");
  EXPECT_ERROR(draw_plot(example(), DocumentFormat::png, 60, 40), InputError,
               "plot of 60 x 40 pixels leaves no room between its labels");
}

}  // namespace
}  // namespace anticrack
