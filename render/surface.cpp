#include "surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace anticrack {

namespace {

constexpr int edge = SolidField::edge;
constexpr int margin = 2;                    // for the smoothed gradient
constexpr int wide = edge + 1 + 2 * margin;  // nodes along a gathered block
constexpr int wide_count = wide * wide * wide;

constexpr int strides[3] = {1, wide, wide* wide};

int node(int i, int j, int k) {
  return (i + margin) + wide * ((j + margin) + wide * (k + margin));
}

/// Corner c of a cell lies at (c & 1, c >> 1 & 1, c >> 2).
constexpr int cell_edges[12][2] = {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3},
                                   {4, 6}, {5, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};

struct BlockValues {
  std::array<float, wide_count> fraction, weighted, smooth;
};

/// Which corners of a cell are solid, as bits.
int solid_corners(const float* fraction, int cell, float isovalue) {
  int mask = 0;
  for (int c = 0; c < 8; ++c) {
    const int corner = cell + (c & 1) * strides[0] + (c >> 1 & 1) * strides[1] + (c >> 2) * strides[2];
    mask |= (fraction[corner] >= isovalue) << c;
  }
  return mask;
}

/// Filtered by (1, 2, 1)/4 along each axis; the outermost layer is left alone.
void smooth_once(const std::array<float, wide_count>& in, std::array<float, wide_count>& out) {
  out = in;
  for (const int stride : strides) {
    std::array<float, wide_count> before = out;
    for (int i = stride; i < wide_count - stride; ++i) {
      out[std::size_t(i)] = 0.25f * (before[std::size_t(i - stride)] + before[std::size_t(i + stride)]) +
                            0.5f * before[std::size_t(i)];
    }
  }
}

struct Trilinear {
  int first;
  float weight[8];

  Trilinear(int cell, const Point& f) : first(cell) {
    for (int c = 0; c < 8; ++c) {
      weight[c] = (c & 1 ? f[0] : 1 - f[0]) * (c >> 1 & 1 ? f[1] : 1 - f[1]) * (c >> 2 ? f[2] : 1 - f[2]);
    }
  }
  template <class Value>
  float operator()(Value&& value) const {
    float sum = 0;
    for (int c = 0; c < 8; ++c) {
      sum +=
          weight[c] * value(first + (c & 1) * strides[0] + (c >> 1 & 1) * strides[1] + (c >> 2) * strides[2]);
    }
    return sum;
  }
};

void place_vertex(const BlockValues& v, const SolidField::Block& block, double spacing,
                  const std::array<int, 3>& local, float isovalue, Mesh& mesh, std::size_t id) {
  const int cell = node(local[0], local[1], local[2]);
  Point f{};
  int crossings = 0;
  for (const auto& [a, b] : cell_edges) {
    const auto value = [&](int c) {
      return v.fraction[std::size_t(cell + (c & 1) * strides[0] + (c >> 1 & 1) * strides[1] +
                                    (c >> 2) * strides[2])];
    };
    const float va = value(a);
    const float vb = value(b);
    if ((va >= isovalue) == (vb >= isovalue)) continue;
    const float t = (isovalue - va) / (vb - va);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float from = float(a >> axis & 1);
      f[axis] += from + t * (float(b >> axis & 1) - from);
    }
    ++crossings;
  }
  for (float& c : f) c /= float(crossings);

  const Trilinear at(cell, f);
  Point gradient;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    gradient[axis] = at([&](int i) {
      return v.smooth[std::size_t(i + strides[axis])] - v.smooth[std::size_t(i - strides[axis])];
    });
  }
  const float length = std::hypot(gradient[0], gradient[1], gradient[2]);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    mesh.position[id][axis] = float((block.origin[axis] + local[axis] + double(f[axis])) * spacing);
    mesh.normal[id][axis] = length > 0 ? -gradient[axis] / length : float(axis == 1);
  }
  mesh.scalar[id] = at([&](int i) { return v.weighted[std::size_t(i)]; }) /
                    at([&](int i) { return v.fraction[std::size_t(i)]; });
}

using CellVertices = std::array<std::int32_t, SolidField::nodes>;  // number within the block, -1 without

/// Two triangles for each lattice edge that the surface crosses: they join the vertices of the four cells
/// around it.
template <class VertexOf>
void join_cells(const float* fraction, float isovalue, const Mesh& mesh, VertexOf&& vertex_of,
                std::vector<std::array<std::uint32_t, 3>>& triangles) {
  for (int k = 0; k < edge; ++k) {
    for (int j = 0; j < edge; ++j) {
      for (int i = 0; i < edge; ++i) {
        const int here = node(i, j, k);
        const bool solid = fraction[here] >= isovalue;
        for (int axis = 0; axis < 3; ++axis) {
          if (solid == (fraction[here + strides[axis]] >= isovalue)) continue;
          const int u = (axis + 1) % 3;
          const int w = (axis + 2) % 3;
          std::uint32_t quad[4];
          for (int corner = 0; corner < 4; ++corner) {
            std::array<int, 3> cell{i, j, k};
            cell[std::size_t(u)] -= corner == 0 || corner == 3;
            cell[std::size_t(w)] -= corner == 0 || corner == 1;
            quad[corner] = vertex_of(cell);
          }
          if (!solid) std::swap(quad[1], quad[3]);
          const auto apart = [&](std::uint32_t a, std::uint32_t b) {
            const Point& p = mesh.position[a];
            const Point& q = mesh.position[b];
            return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
          };
          if (apart(quad[0], quad[2]) <= apart(quad[1], quad[3])) {
            triangles.push_back({quad[0], quad[1], quad[2]});
            triangles.push_back({quad[0], quad[2], quad[3]});
          } else {
            triangles.push_back({quad[0], quad[1], quad[3]});
            triangles.push_back({quad[1], quad[2], quad[3]});
          }
        }
      }
    }
  }
}

}  // namespace

Mesh extract_surface(const SolidField& field) {
  const auto& blocks = field.blocks();
  const float isovalue = field.surface_fraction();

  // Number the vertices: first within each block, then over the blocks.
  std::vector<CellVertices> vertices(blocks.size());
  std::vector<std::uint32_t> first(blocks.size() + 1, 0);
  tbb::parallel_for(std::size_t(0), blocks.size(), [&](std::size_t b) {
    vertices[b].fill(-1);
    std::array<float, wide_count> fraction;
    field.gather(blocks[b], &SolidField::Block::fraction, margin, fraction.data());
    std::int32_t count = 0;
    for (int cell = 0; cell < SolidField::nodes; ++cell) {
      const int mask = solid_corners(fraction.data(), node(cell & 7, cell >> 3 & 7, cell >> 6), isovalue);
      if (mask != 0 && mask != 255) vertices[b][std::size_t(cell)] = count++;
    }
    first[b + 1] = std::uint32_t(count);
  });
  for (std::size_t b = 0; b < blocks.size(); ++b) first[b + 1] += first[b];

  Mesh mesh;
  mesh.spacing = float(field.spacing());
  mesh.position.resize(first.back());
  mesh.normal.resize(first.back());
  mesh.scalar.resize(first.back());
  const auto for_surface_blocks = [&](auto&& work) {
    tbb::parallel_for(std::size_t(0), blocks.size(), [&](std::size_t b) {
      bool any = false;
      for (const std::int32_t near : blocks[b].near) {
        any = any || (near >= 0 && first[std::size_t(near) + 1] > first[std::size_t(near)]);
      }
      if (any) work(b);
    });
  };
  for_surface_blocks([&](std::size_t b) {
    if (first[b + 1] == first[b]) return;
    BlockValues v;
    field.gather(blocks[b], &SolidField::Block::fraction, margin, v.fraction.data());
    field.gather(blocks[b], &SolidField::Block::weighted, margin, v.weighted.data());
    smooth_once(v.fraction, v.smooth);
    for (int cell = 0; cell < SolidField::nodes; ++cell) {
      const std::int32_t number = vertices[b][std::size_t(cell)];
      if (number < 0) continue;
      place_vertex(v, blocks[b], field.spacing(), {cell & 7, cell >> 3 & 7, cell >> 6}, isovalue, mesh,
                   first[b] + std::size_t(number));
    }
  });

  std::vector<std::vector<std::array<std::uint32_t, 3>>> triangles(blocks.size());
  for_surface_blocks([&](std::size_t b) {
    std::array<float, wide_count> fraction;
    field.gather(blocks[b], &SolidField::Block::fraction, margin, fraction.data());
    const auto vertex_of = [&](const std::array<int, 3>& cell) {
      int near = 13;
      int local[3];
      for (int axis = 0, stride = 1; axis < 3; ++axis, stride *= 3) {
        const int c = cell[std::size_t(axis)];
        local[axis] = c < 0 ? c + edge : c;
        if (c < 0) near -= stride;
      }
      const auto n = std::size_t(blocks[b].near[std::size_t(near)]);
      return first[n] +
             std::uint32_t(vertices[n][std::size_t(local[0] + edge * (local[1] + edge * local[2]))]);
    };
    join_cells(fraction.data(), isovalue, mesh, vertex_of, triangles[b]);
  });
  std::size_t count = 0;
  for (const auto& t : triangles) count += t.size();
  mesh.triangle.reserve(count);
  for (const auto& t : triangles) mesh.triangle.insert(mesh.triangle.end(), t.begin(), t.end());
  return mesh;
}

}  // namespace anticrack
