#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "camera.h"
#include "color_map.h"
#include "image.h"
#include "io/frame.h"
#include "render_frames.h"
#include "render_options.h"

namespace anticrack {

/// Told the seconds of each stage: "surface 0.31 s, ...".
using StageReport = std::function<void(std::string_view)>;

/// The bare picture of a frame, of the camera's size.
Image draw_frame(const Frame& frame, const RenderField& field, const ColorScale& scale, const Camera& camera,
                 const RenderSettings& settings, const StageReport& report);

/// What a picture's text chunk says: enough to draw it again from the same frame.
TextChunks picture_text(const FrameHeader& header, const RenderField& field, const ColorScale& scale,
                        const RenderSettings& settings, const RenderArguments& arguments);

}  // namespace anticrack
