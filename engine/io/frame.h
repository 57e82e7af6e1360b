#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "vec3.h"

namespace anticrack {

/// What a frame says of itself, stored as metadata of its file.
struct FrameHeader {
  int index = 0;  ///< from 0, in output order
  std::int64_t step = 0;
  double time = 0;                      ///< [s]
  std::array<double, 3> strain{};       ///< nominal strain of the box along x, y, z (negative in compression)
  double seconds_since_last_frame = 0;  ///< [s]; dkappa / this = plastic strain rate
  Vec3 box_lower = Vec3::Zero();        ///< [m] current walls
  Vec3 box_upper = Vec3::Zero();        ///< [m]
  double particle_spacing = 0;          ///< [m] edge of the cube a particle stood for at the start
  double cell_size = 0;                 ///< [m] dx of the background grid
  std::string run;                      ///< a label, e.g. "phi = 0.34"
};

/// One output instant: the particles in no particular order, `id` (0-based seeding order) identifies them
/// across frames. Vectors all have one entry a particle; a field the run does not have (kappa of an elastic
/// run) is empty.
struct Frame {
  FrameHeader header;
  std::vector<std::uint32_t> id;
  std::vector<std::array<float, 3>> position;  ///< [m]
  std::vector<std::array<float, 3>> velocity;  ///< [m/s]
  std::vector<float> kappa;                    ///< accumulated |dev eps^p| [-]
  std::vector<float> dkappa;                   ///< its increment since the last frame [-]
  std::vector<float> pressure;                 ///< p, compression positive [Pa]
  std::vector<float> von_mises;                ///< q [Pa]
};

/// Writes `frame_NNNN.vdb` (point grid `particles` with named attributes; float grids `solid` and `kappa` for
/// programs that show volumes only; world space in the metadata's `length_unit`, all else in SI units) into
/// `folder`, each file under a temporary name first.
/// @throws FileError
std::filesystem::path write_frame(const Frame& frame, const std::filesystem::path& folder);

/// Reads a file that `write_frame` wrote. @throws FileError
Frame read_frame(const std::filesystem::path& file);

/// The same without the particles, in a fraction of the time. @throws FileError
FrameHeader read_frame_header(const std::filesystem::path& file);

/// All frames of a run folder's `frames/`, in order of index. @throws FileError if there is none
std::vector<std::filesystem::path> list_frames(const std::filesystem::path& folder);

/// Writes `frame_NNNN.vtp` (inline data; arrays points, id, radius, v, kappa, ...) and brings `frames.pvd`,
/// the time series that ParaView opens, up to date. @throws FileError
void write_paraview_frame(const Frame& frame, const std::filesystem::path& folder);

}  // namespace anticrack
