#include "image_options.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>

#include "errors.h"
#include "exit_codes.h"
#include "scene_units.h"

namespace anticrack {

namespace {

std::optional<int> whole_number(std::string_view text) {
  int value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  if (read.ec != std::errc() || read.ptr != text.data() + text.size() || value < 0) return {};
  return value;
}

std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t end; (end = text.find(separator)) != std::string_view::npos; text.remove_prefix(end + 1))
    parts.emplace_back(text.substr(0, end));
  parts.emplace_back(text);
  return parts;
}

[[noreturn]] void refuse(std::string_view option, std::string_view value, std::string_view expected) {
  throw InputError(fmt::format("{} {}; expected {}.", option, value, expected));
}

std::vector<int> whole_numbers(std::string_view option, const std::string& text, std::string_view expected) {
  std::vector<int> numbers;
  for (const std::string& part : split(text, ',')) {
    const std::optional<int> number = whole_number(part);
    if (!number) refuse(option, text, expected);
    numbers.push_back(*number);
  }
  return numbers;
}

// "x0:x1,y0:y1,z0:z1", a number left out: from the first, to the last.
void parse_crop(const std::string& text, Segmentation& segmentation) {
  constexpr std::string_view expected = "x0:x1,y0:y1,z0:z1: first voxel and the one behind the last";
  const std::vector<std::string> axes = split(text, ',');
  if (axes.size() != 3) refuse("--crop", text, expected);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<std::string> ends = split(axes[axis], ':');
    if (ends.size() != 2) refuse("--crop", text, expected);
    for (std::size_t end = 0; end < 2; ++end) {
      if (ends[end].empty()) continue;
      const std::optional<int> number = whole_number(ends[end]);
      if (!number) refuse("--crop", text, expected);
      segmentation.crop[axis][end] = *number;
    }
  }
}

/// Refuses what takes more memory than the machine has.
void check_memory(const std::string& file, const Index3& size, double bytes) {
  const double memory = double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGE_SIZE));
  if (bytes > memory)
    throw InputError(
        fmt::format("{}: {} x {} x {} voxels need about {:.1f} GB; this machine has {:.1f} GB. Use --crop or "
                    "--downsample.",
                    file, size[0], size[1], size[2], bytes / 1e9, memory / 1e9));
}

}  // namespace

void add_image_options(CLI::App& command, ImageOptions& options) {
  command
      .add_option("--voxel-size", options.voxel_size,
                  "Edge of a voxel with its unit (m without); never guessed from the file")
      ->type_name("LENGTH");
  command.add_option("--solid", options.solid, "Values that are solid; by default the greater of two")
      ->type_name("V[,V]");
  command
      .add_option("--threshold", options.threshold, "This grey value and above are solid; otsu chooses one")
      ->type_name("T|otsu");
  command.add_option("--crop", options.crop, "Part of the image: first voxel and the one behind the last")
      ->type_name("x0:x1,y0:y1,z0:z1");
  command
      .add_option("--downsample", options.downsample,
                  "Blocks of N^3 voxels become one, by majority of the phases")
      ->check(CLI::Range(1, most_along_an_axis))
      ->type_name("N");
  command.add_option("--shape", options.shape, "Voxels of a file of raw bytes, x fastest")
      ->type_name("NX,NY,NZ");
  command.add_option("--type", options.type, "Voxels of a file of raw bytes: uint8 (default), uint16")
      ->check(CLI::IsMember({"uint8", "uint16"}));
  command.add_option("--byte-order", options.byte_order, "Of raw uint16: little (default), big")
      ->check(CLI::IsMember({"little", "big"}));
}

void add_conversion_options(CLI::App& command, ConversionOptions& options, const ConversionTexts& texts) {
  command.add_option(texts.input_name, options.input, texts.input)->required()->type_name(texts.input_type);
  command.add_option("-o,--output", options.output, texts.output)->required()->type_name(texts.output_type);
  add_image_options(command, options);
  command.add_flag("--force", options.force, "Replace an existing file");
  add_threads_option(command, options);
  add_progress_options(command, options);
}

double parse_voxel_size(const ImageOptions& options) {
  if (options.voxel_size.empty())
    throw InputError(
        "--voxel-size is missing; expected the edge of a voxel, e.g. --voxel-size '5.345 um'. It is never "
        "guessed from the image.");
  const ParsedQuantity quantity = parse_quantity(options.voxel_size, Dimension::length);
  if (!quantity.value)
    throw InputError(fmt::format("--voxel-size \"{}\": {}", options.voxel_size, quantity.problem));
  if (!(*quantity.value > 0) || !std::isfinite(*quantity.value))
    refuse("--voxel-size", options.voxel_size, "a finite length > 0");
  return *quantity.value;
}

RawLayout parse_raw_layout(const ImageOptions& options) {
  RawLayout raw;
  raw.bits = options.type == "uint16" ? 16 : 8;
  raw.big_endian = options.byte_order == "big";
  if (options.shape.empty()) return raw;
  const std::vector<int> shape = whole_numbers("--shape", options.shape, "three numbers of voxels NX,NY,NZ");
  if (shape.size() != 3) refuse("--shape", options.shape, "three numbers of voxels NX,NY,NZ");
  raw.shape = Index3{shape[0], shape[1], shape[2]};
  return raw;
}

Segmentation parse_segmentation(const ImageOptions& options) {
  Segmentation segmentation;
  segmentation.downsample = options.downsample;
  if (!options.crop.empty()) parse_crop(options.crop, segmentation);
  if (!options.solid.empty() && !options.threshold.empty())
    throw InputError("--solid and --threshold exclude each other.");
  if (!options.solid.empty())
    segmentation.solid = SolidLabels{whole_numbers("--solid", options.solid, "labels from 0 to 65535")};
  if (options.threshold == "otsu") {
    segmentation.solid = OtsuThreshold{};
  } else if (!options.threshold.empty()) {
    const std::optional<int> threshold = whole_number(options.threshold);
    if (!threshold) refuse("--threshold", options.threshold, "a grey value from 0 to 65535, or otsu");
    segmentation.solid = SolidFrom{*threshold};
  }
  return segmentation;
}

ImageProgress::ImageProgress(const ProgressOptions& options) : progress_(options) {}

Watch ImageProgress::watch(std::string what, double voxels, double from, double to) {
  const auto start = std::chrono::steady_clock::now();
  return [this, what = std::move(what), voxels, from, to, start](double done) {
    if (signals_.requested()) throw Stopped("stopped by a signal; nothing was written.");
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    progress_.update({.fraction = from + done * (to - from),
                      .of_study = what,
                      .voxels_per_second = seconds > 0 ? done * voxels / seconds : 0});
  };
}

PhaseSlices open_phase_slices(const std::string& file, const ImageOptions& options, ImageProgress& progress,
                              const std::function<double(const Index3& size)>& memory) {
  const Segmentation segmentation = parse_segmentation(options);
  auto image = open_image(file, parse_raw_layout(options));
  const Index3 all = image->size();
  const Index3 size = segmented_size(all, segmentation, file);
  check_memory(file, size, memory(size));
  return PhaseSlices(std::move(image), file, segmentation,
                     progress.watch("counting values", double(all[0]) * all[1] * all[2], 0, 0.1));
}

}  // namespace anticrack
