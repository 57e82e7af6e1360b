#pragma once

#include <functional>
#include <string>

#include "common_options.h"
#include "images/segmentation.h"
#include "progress.h"
#include "stop_signal.h"

namespace CLI {
class App;
}

namespace anticrack {

/// How to take an image from disk: what every subcommand that reads scans offers.
struct ImageOptions {
  std::string voxel_size, shape, type = "uint8", byte_order = "little", solid, threshold, crop;
  int downsample = 1;
};

/// --voxel-size, --shape, --type, --byte-order, --solid, --threshold, --crop, --downsample
void add_image_options(CLI::App& command, ImageOptions& options);

/// What subcommands offer that turn a file into another, one of them an image.
struct ConversionOptions : CommonOptions, ImageOptions {
  std::string input, output;
  bool force = false;
};

/// How the input, a required positional argument, and the output are called and explained.
struct ConversionTexts {
  std::string input_name, input, input_type, output, output_type;
};

/// The input, -o, those of an image, --force, --threads, --quiet, --log-json
void add_conversion_options(CLI::App& command, ConversionOptions& options, const ConversionTexts& texts);

/// [m]. @throws InputError  missing, no length, or not positive
double parse_voxel_size(const ImageOptions& options);
RawLayout parse_raw_layout(const ImageOptions& options);       ///< @throws InputError
Segmentation parse_segmentation(const ImageOptions& options);  ///< @throws InputError

/// Shows progress through an image and ends the work on Ctrl-C or SIGTERM.
class ImageProgress {
 public:
  explicit ImageProgress(const ProgressOptions& options);

  /// For a piece of work on so many voxels, from one share of the whole to another.
  /// The watch throws Stopped once a signal has come.
  Watch watch(std::string what, double voxels, double from, double to);
  void message(std::string_view text) { progress_.message(text); }

 private:
  StopOnSignal signals_;
  Progress progress_;
};

/// An image as solid and pore, as the options say; its values are counted, as the first tenth of the work.
/// @param memory  of the work to come [bytes], by the voxels that are left; what the machine does not have is
/// refused
/// @throws InputError, FileError
PhaseSlices open_phase_slices(const std::string& file, const ImageOptions& options, ImageProgress& progress,
                              const std::function<double(const Index3& size)>& memory);

}  // namespace anticrack
