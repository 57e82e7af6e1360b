#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "camera.h"
#include "io/frame.h"

namespace anticrack {

/// A quantity that a frame can be coloured by.
struct RenderField {
  std::string_view name;
  std::string_view label;  ///< with unit and the canvas's markup
  bool is_signed;
  double unit;  ///< of the label, in SI
};

/// @throws InputError  naming the choices
const RenderField& find_field(std::string_view name);

/// One value a particle, in the label's unit. @throws InputError  if the run has no such field
std::vector<float> field_values(const Frame& frame, const RenderField& field);

/// Frames of a run, by index.
class RunFrames {
 public:
  /// @param path  a run folder, its frames/ folder, or one frame file
  /// @throws InputError  if it is none of them
  explicit RunFrames(const std::filesystem::path& path);

  const std::vector<std::pair<int, std::filesystem::path>>& files() const { return files_; }
  /// @param text  an index or "last" (a single frame file is always itself)
  /// @throws InputError  naming the range
  const std::filesystem::path& file(std::string_view text) const;
  /// The frame whose nominal compression comes closest; reads them all. @param strain  [-], positive
  const std::filesystem::path& closest(double strain) const;
  std::string name() const { return name_; }  ///< of the folder

 private:
  std::filesystem::path path_;
  std::string name_;
  std::vector<std::pair<int, std::filesystem::path>> files_;
};

/// Axis of the largest nominal strain.
int loading_axis(const FrameHeader& header);

/// "ε_y = −11.0 %".
std::string strain_label(const FrameHeader& header);

/// The walls, widened to what lies outside them.
Box frame_box(const Frame& frame);

}  // namespace anticrack
