#pragma once

#include <cstdint>
#include <memory>
#include <vector>

namespace anticrack {

/// A current OpenGL 3.3 core context that draws into memory, without display. OSMesa today; Mesa 25.1 drops
/// it, and surfaceless EGL can take its place behind this interface.
class GlContext {
 public:
  virtual ~GlContext() = default;
  virtual void* function(const char* name) const = 0;  ///< null if the context does not know it
  virtual const std::vector<std::uint8_t>&
  finish() = 0;  ///< RGBA bytes, rows from the top, once drawing is done
};

/// Loads OSMesa on first use (51 MB, 21 ms). The context is current in the calling thread until destroyed.
/// @throws FileError   if the library is not installed
/// @throws InputError  if it cannot draw that many pixels
std::unique_ptr<GlContext> make_osmesa_context(int width, int height);

}  // namespace anticrack
