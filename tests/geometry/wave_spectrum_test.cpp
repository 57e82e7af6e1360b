#include "fields/wave_spectrum.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "errors.h"
#include "expect_error.h"
#include "fields/gaussian_random_field.h"
#include "io_test_folder.h"

namespace anticrack {
namespace {

TEST(WaveSpectrum, QuantilesInvertTheShareOfALinearDensity) {
  // Density 2 eta on (0, 1] but for a gap in front, so that the share below eta is eta^2 to 1e-12.
  const WaveSpectrum rising({{1e-6, 1e-6}, {1, 1}});
  for (double p : {0.0, 0.01, 0.3, 0.75, 0.999999}) EXPECT_NEAR(rising.quantile(p), std::sqrt(p), 1e-5) << p;
  const WaveSpectrum falling({{1, 3}, {2, 0}, {5, 0}, {6, 3}});
  EXPECT_NEAR(falling.quantile(0.375), 2 - std::sqrt(0.25),
              1e-12);  // a quarter of the first triangle is left
  EXPECT_NEAR(falling.quantile(0.5 + 0.125), 5 + std::sqrt(0.25), 1e-12);
}

TEST(WaveSpectrum, WavesHaveItsMoments) {
  const WaveSpectrum spectrum({{20, 0}, {25, 4}, {30, 0}, {90, 0}, {100, 1}, {110, 0}});
  // Triangles of areas 20 and 10 about 25 and 100: variance (half base)^2 / 6.
  EXPECT_NEAR(spectrum.mean(), 50, 1e-12);
  const double square = (2 * (625 + 25.0 / 6) + (10000 + 100.0 / 6)) / 3;
  EXPECT_NEAR(spectrum.mean_square(), square, 1e-9);
  GaussianRandomFieldSpec spec{100000, 0, 0, 3};
  spec.spectrum = spectrum;
  double mean = 0, squares = 0;
  const auto field = GaussianRandomField::sample(spec, 1.0);
  for (const PlaneWave& wave : field.waves())
    mean += wave.eta.norm() / spec.waves, squares += wave.eta.squaredNorm() / spec.waves;
  // Five standard errors; eta^2 is about 630 or 10000.
  EXPECT_NEAR(mean, 50, 5 * std::sqrt((square - 2500) / spec.waves));
  EXPECT_NEAR(squares, square, 5 * 4420 / std::sqrt(double(spec.waves)));
}

class SpectrumFile : public IoTest {
 protected:
  void expect_refused(const std::string& text, const std::string& message) const {
    put_file(folder / "s.csv", text);
    EXPECT_ERROR(read_wave_spectrum(folder / "s.csv"), InputError, (folder / "s.csv").string() + message);
  }
};

TEST_F(SpectrumFile, IsRefusedByFileAndLineAndWhatWasExpected) {
  const std::string header = "# measured\nwave_number,weight\n";
  expect_refused("# measured\neta,p\n1,2\n",
                 ":2: eta,p; expected the header wave_number,weight (1/m, density)");
  expect_refused(header + "1,2\n\n3;4\n", ":5: 3;4; expected two numbers wave_number,weight");
  expect_refused(header + "1,2\n3,4 m\n", ":4: 3,4 m; expected two numbers wave_number,weight");
  expect_refused("", ": spectrum: 0 rows; expected at least two");
  expect_refused(header + "1,2\n", ": spectrum: 1 rows; expected at least two");
  expect_refused(header + "1,2\n1,2\n", ": spectrum: row 2: wave_number = 1; expected > 1");
  expect_refused(header + "1,2\n2,-1\n", ": spectrum: row 2: weight = -1; expected >= 0");
  expect_refused(header + "1,0\n2,0\n", ": spectrum: every weight is 0; expected at least one > 0");
}

TEST_F(SpectrumFile, ThatCannotBeReadIsAnErrorWithTheReason) {
  EXPECT_ERROR(read_wave_spectrum(folder), FileError, folder.string() + ": cannot be read: Is a directory");
  EXPECT_ERROR(read_wave_spectrum(folder / "none.csv"), FileError,
               "none.csv: cannot be read: No such file or directory");
}

// Values from before there was more than one morphology. Two libraries' cosines and logarithms differ in the
// last bit.
TEST(GaussianRandomField, SameSeedKeepsItsField) {
  const auto field = GaussianRandomField::sample({1000, 9, 50, 1}, 1.0);
  const std::array<PlaneWave, 2> golden = {
      {{{-30.22550473920851, -18.061904065170907, 43.963165948612193}, 4.2222896495733346},
       {{45.434636234846508, 1.4599172652499544, -16.672036351734537}, 2.3801895467656111}}};
  for (const std::size_t n : {0, 1}) {
    const PlaneWave& wave = field.waves()[n * 999];
    EXPECT_DOUBLE_EQ(wave.phase, golden[n].phase);
    EXPECT_LT((wave.eta - golden[n].eta).norm(), 1e-12);
  }
  const auto values = field.evaluate_on_lattice({{20, 20, 20}, 0.05}, 0);
  EXPECT_NEAR(values[0], -0.052385018226305514, 1e-13);
  EXPECT_NEAR(values[4210], 0.20723744370699071, 1e-13);
  EXPECT_NEAR(values[7999], -0.53576610148524828, 1e-13);
}

}  // namespace
}  // namespace anticrack
