#include "embedded_assets.h"

#include <cstddef>

// The assembler copies the file into read-only data: no generated source, no file to find at run time.
#define EMBED(name, file)                                                                                    \
  asm(".pushsection .rodata\n" #name "_begin: .incbin \"" ANTICRACK_ASSETS "/" file "\"\n" #name             \
      "_end: .byte 0\n.globl " #name "_begin\n.globl " #name "_end\n.hidden " #name "_begin\n.hidden " #name \
      "_end\n.popsection");                                                                                  \
  extern "C" __attribute__((visibility("hidden"))) const char name##_begin[], name##_end[]

EMBED(anticrack_font, "fonts/Inter-Regular.otf");
EMBED(anticrack_strain_colors, "colormaps/strain.csv");
EMBED(anticrack_signed_colors, "colormaps/signed.csv");

namespace anticrack {

namespace {
std::string_view between(const char* begin, const char* end) {
  return {begin, std::size_t(end - begin)};
}
}  // namespace

std::string_view embedded_font() {
  return between(anticrack_font_begin, anticrack_font_end);
}

std::string_view embedded_strain_colors() {
  return between(anticrack_strain_colors_begin, anticrack_strain_colors_end);
}

std::string_view embedded_signed_colors() {
  return between(anticrack_signed_colors_begin, anticrack_signed_colors_end);
}

}  // namespace anticrack
