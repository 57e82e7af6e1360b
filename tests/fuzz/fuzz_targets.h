#pragma once

#include <cstdint>
#include <span>

namespace anticrack {

/// Each gives any bytes to one reader, which may refuse them with InputError or FileError; whatever else it
/// throws escapes, and a sanitizer stops the rest.
using FuzzTarget = void(std::span<const std::uint8_t> bytes);

FuzzTarget fuzz_scene;       ///< a scene; behind a zero byte, overrides, one a line
FuzzTarget fuzz_tiff;        ///< a scan in a TIFF file
FuzzTarget fuzz_raw;         ///< three bytes of shape, then a scan of raw bytes
FuzzTarget fuzz_nrrd;        ///< a scan as NRRD
FuzzTarget fuzz_meta;        ///< a scan as MetaImage
FuzzTarget fuzz_npy;         ///< a scan as NumPy array
FuzzTarget fuzz_spectrum;    ///< the table of a spectrum
FuzzTarget fuzz_vdb;         ///< metadata of an OpenVDB file, as `anticrack info` and all readers take them
FuzzTarget fuzz_checkpoint;  ///< a checkpoint whose checksums are made right first

}  // namespace anticrack
