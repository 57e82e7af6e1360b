#include <fields/morphology.h>
#include <io/provenance.h>
#include <microstructure.h>

#include <cstdio>

int main() {
  const anticrack::SampleLattice lattice{{4, 8, 4}, 0.25};
  const auto positions = anticrack::seed_particles(anticrack::full_block(lattice), lattice);
  std::printf("%zu points, anticrack %s\n", positions.size(),
              std::string(anticrack::program_version()).c_str());
  return positions.size() == lattice.count() ? 0 : 1;
}
