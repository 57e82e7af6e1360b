#include "image.h"

#include <gtest/gtest.h>
#include <png.h>

#include "errors.h"
#include "expect_error.h"
#include "png_content.h"

namespace anticrack {
namespace {

TEST(Image, PngHoldsThePixels) {
  Image image(7, 5);
  for (int i = 0; i < 35; ++i)
    image.pixels[std::size_t(i)] = {std::uint8_t(i), std::uint8_t(7 * i), std::uint8_t(255 - i)};
  const Image read = decode_png(encode_png(image));
  EXPECT_EQ(read.width, 7);
  EXPECT_EQ(read.height, 5);
  EXPECT_EQ(read.pixels, image.pixels);
}

TEST(Image, PngSaysItsColourSpaceAndTextAndNoDate) {
  const std::string bytes = encode_png(Image(2, 2), {{"Parameters", "--field kappa \u03ba"}});
  EXPECT_NE(bytes.find("sRGB"), std::string::npos);
  EXPECT_NE(bytes.find("iTXt"), std::string::npos);
  EXPECT_NE(bytes.find("--field kappa \u03ba"), std::string::npos);
  EXPECT_EQ(bytes.find("tIME"), std::string::npos);
}

TEST(Image, EmptyIsRefused) {
  EXPECT_ERROR(encode_png(Image()), InputError, "image is empty; expected at least one pixel");
}

TEST(Image, LargerThanAPngCanBeIsRefusedByItsEncoder) {
  EXPECT_ERROR(encode_png(Image(1000001, 1)), InputError, "PNG encoder: Invalid IHDR data");
}

TEST(Image, SrgbIsItsOwnInverseForEveryByte) {
  for (int i = 0; i < 256; ++i) EXPECT_EQ(encode_srgb(decode_srgb(std::uint8_t(i))), i);
  EXPECT_EQ(encode_srgb(-1), 0);
  EXPECT_EQ(encode_srgb(2), 255);
  EXPECT_NEAR(decode_srgb(188), 0.5, 0.005);  // IEC 61966-2-1: 0.5 is encoded as 187.5
}

}  // namespace
}  // namespace anticrack
