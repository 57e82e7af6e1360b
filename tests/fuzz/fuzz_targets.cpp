#include "fuzz/fuzz_targets.h"

#include <libdeflate.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "errors.h"
#include "fields/wave_spectrum.h"
#include "files/vdb_seal.h"
#include "files/vdb_structure.h"
#include "fuzz/memory_file.h"
#include "images/slice_reader.h"
#include "info.h"
#include "io/checkpoint.h"
#include "scene.h"

namespace anticrack {
namespace {

template <class Read>
void refuse_or_read(const Read& read) {
  try {
    read();
  } catch (const InputError&) {
  } catch (const FileError&) {
  }
}

// The first slices and the last.
void read_image(std::span<const std::uint8_t> bytes, const std::string& ending, const RawLayout& raw = {}) {
  const MemoryFile file(bytes, ending);
  refuse_or_read([&] {
    const auto image = open_image(file.path(), raw);
    std::vector<std::uint16_t> labels;
    const int slices = image->size()[2];
    for (const int k : {0, std::min(1, slices - 1), slices - 1}) {
      image->read(k, labels);
      if (labels.size() != std::size_t(image->size()[0]) * std::size_t(image->size()[1]))
        throw std::logic_error("a slice of another size");
    }
  });
}

}  // namespace

void fuzz_scene(std::span<const std::uint8_t> bytes) {
  const auto zero = std::ranges::find(bytes, 0);
  std::vector<std::string> overrides;
  for (auto at = zero; at != bytes.end();) {
    const auto end = std::find(at + 1, bytes.end(), std::uint8_t('\n'));
    overrides.emplace_back(at + 1, end);
    at = end;
  }
  const MemoryFile file({bytes.begin(), zero}, ".toml");
  refuse_or_read([&] {
    const Scene scene = read_scene(file.path(), overrides);
    // What is accepted is written so that it reads back.
    const std::string text = to_toml(scene);
    const MemoryFile again({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()},
                           ".resolved.toml");
    std::string second;
    try {
      second = to_toml(read_scene(again.path()));
    } catch (const InputError& error) {
      throw std::logic_error(text + error.what());
    }
    if (second != text) throw std::logic_error("not the same scene:\n" + text + second);
  });
  refuse_or_read([&] { read_sample_scene(file.path(), overrides); });
  refuse_or_read([&] { read_material_scene(file.path(), overrides); });
}

void fuzz_tiff(std::span<const std::uint8_t> bytes) {
  read_image(bytes, ".tif");
}

void fuzz_raw(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 3) return;
  read_image(bytes.subspan(3), ".raw", {.shape = Index3{std::int8_t(bytes[0]), bytes[1], bytes[2]}});
}

void fuzz_nrrd(std::span<const std::uint8_t> bytes) {
  read_image(bytes, ".nrrd");
}

void fuzz_meta(std::span<const std::uint8_t> bytes) {
  read_image(bytes, ".mha");
}

void fuzz_npy(std::span<const std::uint8_t> bytes) {
  read_image(bytes, ".npy");
}

void fuzz_spectrum(std::span<const std::uint8_t> bytes) {
  const MemoryFile file(bytes, ".csv");
  refuse_or_read([&] {
    const WaveSpectrum spectrum = read_wave_spectrum(file.path());
    double last = spectrum.rows().front().wave_number;
    for (const double share : {0.0, 0.25, 0.5, 0.75, 0x1.fffffffffffffp-1}) {
      const double wave_number = spectrum.quantile(share);
      if (!(wave_number >= last && wave_number <= spectrum.rows().back().wave_number))
        throw std::logic_error("a quantile outside its table");
      last = wave_number;
    }
  });
}

void fuzz_vdb(std::span<const std::uint8_t> bytes) {
  // Without offsets, metadata lie behind trees, and OpenVDB's reader of trees trusts its file.
  constexpr std::size_t offset_flag = 20;
  if (bytes.size() > offset_flag && bytes[offset_flag] == 0) return;
  const MemoryFile file(bytes, ".vdb");
  refuse_or_read([&] { describe_vdb(file.path()); });
}

void fuzz_checkpoint(std::span<const std::uint8_t> bytes) {
  std::vector<std::uint8_t> content(bytes.begin(), bytes.end());
  constexpr std::size_t head = 40, table_size = 24, table_checksum = 32, head_checksum = 36;
  if (content.size() >= head) {
    const auto put_checksum = [&](std::size_t begin, std::size_t size, std::size_t to) {
      const std::uint32_t sum = libdeflate_crc32(0, content.data() + begin, size);
      std::memcpy(&content[to], &sum, sizeof sum);
    };
    std::uint64_t size = 0;
    std::memcpy(&size, &content[table_size], sizeof size);
    if (size <= content.size() - head) put_checksum(head, size, table_checksum);
    put_checksum(0, head_checksum, head_checksum);
  }
  const MemoryFile file(content, ".bin");
  refuse_or_read([&] {
    CheckpointReader reader(file.path());
    refuse_or_read([&] { reader.verify(); });
    refuse_or_read([&] { reader.scene(); });
    refuse_or_read([&] { reader.read<double>("x"); });
  });
}

}  // namespace anticrack
