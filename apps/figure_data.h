#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace anticrack {

/// One curve of a figure: mean and standard deviation over realizations; theory has no deviation.
struct FigureCurve {
  std::string label;
  std::vector<double> x, mean, deviation;
};

/// One part of a figure, e.g. B.14a.
struct FigurePart {
  std::string name;  ///< of its files: b14a
  std::string title, x_label, y_label;
  std::vector<FigureCurve> curves;
};

/// What the samples of a figure are made of; lengths in units of the side of the cube.
struct FigureSamples {
  int realizations;
  int resolution;  ///< lattice points along a side
  int waves = 10000;
};

/// Called with the share of the work done; may throw to stop it.
using FigureWatch = std::function<void(double done)>;

/// Fig. B.14: distribution of wavelengths a side, and g_norm(r), for several heterogeneities b.
std::vector<FigurePart> figure_b14(const FigureSamples& samples, const FigureWatch& watch);
/// Fig. B.15: specific surface against solid fraction and against resolution, in the paper's way and in
/// unbiased ones.
std::vector<FigurePart> figure_b15(const FigureSamples& samples, const FigureWatch& watch);
/// Fig. B.16: percolating against whole solid fraction; tortuosity of both phases.
std::vector<FigurePart> figure_b16(const FigureSamples& samples, const FigureWatch& watch);

/// curve, x, mean, deviation.
std::string to_csv(const FigurePart& part);

}  // namespace anticrack
