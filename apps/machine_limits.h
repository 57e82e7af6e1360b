#pragma once

namespace anticrack {

/// What a machine can do at most, measured now with the threads that oneTBB may use.
struct MachineLimits {
  double multiply_adds_per_second;  ///< double precision, each lane counted, vectors of the kernels' width
  double bytes_per_second;          ///< streaming: two arrays read and one written, far beyond the caches
};

/// Takes about a second.
MachineLimits measure_machine_limits();

}  // namespace anticrack
