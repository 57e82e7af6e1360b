#pragma once

#include <cstdint>

#include "fields/padded_field.h"
#include "images/segmentation.h"
#include "microstructure.h"

namespace anticrack {

/// How a segmented image becomes smooth: README, "The level set of an image".
struct ImageSmoothing {
  double sigma = 1.25;   ///< of the smoothing kernel, of fourth order [voxels]
  double margin = 0.05;  ///< least |excess| at a voxel centre [-]
};

/// The planes first ... first + count - 1 of an image as an excess field: the Gaussian mean of the indicator
/// (1 solid, 0 pore) less 1/2, which is solid where positive. Where smoothing would flip a voxel, the value
/// is held at `margin` on the voxel's own side. The image goes on beyond its faces as at them.
/// @param slice  gives slice k of the image, 0 <= k < size[2]
PaddedField smooth_excess(const Index3& size, int first, int count, const ImageSmoothing& smoothing,
                          const std::function<const std::uint8_t*(int k)>& slice);

/// The solid of an image as a narrow-band signed distance, capped by the faces of the box, negative at the
/// centre of every solid voxel and positive at that of every other. Built by slabs along z whose thickness
/// depends on nothing but the image's size, so that memory is that of a slab and of the band.
/// @param voxel_size  [m] of the image as it is on disk; downsampling multiplies it
/// @param watch       called several times a slab; what it throws ends the work
/// @param thickness   planes of a slab, a multiple of 8; 0: slab_thickness
/// @throws InputError  voxel_size not positive; no voxel solid after downsampling
Microstructure build_image_level_set(PhaseSlices& slices, double voxel_size, const Watch& watch = {},
                                     const ImageSmoothing& smoothing = {}, int thickness = 0);

/// Planes of a slab that are kept of it; a multiple of 8. @param size  voxels of the image
int slab_thickness(const Index3& size);

/// Most memory of build_image_level_set [bytes]: measured for the slab, and the band of a scan as finely
/// structured as the Berea sandstone.
double image_level_set_memory(const Index3& size);

}  // namespace anticrack
