#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "camera.h"
#include "common_options.h"
#include "mesh.h"

namespace anticrack {

/// The command line of `anticrack render` as typed.
struct RenderArguments : CommonOptions {
  std::vector<std::string> inputs;
  std::string output, frame = "last", field = "kappa", renderer = "embree", mode = "surface";
  std::string cut, range, size, view, title, frames, strains, movie, plot_x, plot_y;
  double percentile = 99.5;
  int samples = 16;
  double frames_per_second = 12;
  bool logarithmic = false, panel = false, plot = false;
};

enum class Renderer { embree, osmesa };
enum class DrawMode { surface, spheres };

/// A cut as asked: which half goes may depend on where the camera stands.
struct CutRequest {
  CutPlane plane;
  bool towards_camera = false;  ///< "x=0.5": remove the half on the camera's side

  CutPlane facing(const Camera& camera) const;
};

/// How to draw, checked and read.
struct RenderSettings {
  Renderer renderer = Renderer::embree;
  DrawMode mode = DrawMode::surface;
  std::optional<CutRequest> cut;
  std::optional<std::array<double, 2>> range, size;
  View view;
  int samples = 16;
};

/// @throws InputError  naming the option, what it got and what it expects
RenderSettings parse_settings(const RenderArguments& arguments);

/// "0.004,0.11" as numbers. @throws InputError  naming the option
std::vector<double> parse_numbers(std::string_view option, std::string_view text);

}  // namespace anticrack
