#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "material/material_parameters.h"
#include "numerics.h"
#include "particles.h"
#include "sparse_grid.h"

namespace anticrack {

enum class Model { hencky, drucker_prager_implicit, drucker_prager_paper };
enum class Transfer { flip, pic, apic };  ///< pic, apic: read neither velocities nor their increments

/// What differs in per-particle code; the one list of the compiled combinations is `ANTICRACK_PASSES` in
/// kernels.cpp.
struct PassKind {
  Model model;
  Transfer transfer;
};

Model model_of(const Material& material, ReturnMapping mapping);
PassKind pass_kind(const Material& material, const Numerics& numerics);
ParticleFields particle_fields(const Material& material, const Numerics& numerics);

/// Material constants in the form that the kernels use.
struct MaterialConstants {
  double bulk_modulus;     ///< K [Pa]
  double mu;               ///< [Pa]
  double friction_factor;  ///< A = gamma / (sqrt6 mu) [1/Pa]
  double cohesion;         ///< c [Pa]
  double softening;        ///< xi [-]

  explicit MaterialConstants(const Material& material);
};

/// Constants of one step.
struct StepConstants {
  double dt;         ///< [s]
  double cell_size;  ///< dx [m]
  double flip;       ///< alpha_f of this step [-]
  double mass;       ///< of a particle [kg]
  double volume;     ///< of a particle at the start, V0 [m^3]
  MaterialConstants material;
  bool full_width;  ///< that of `Kernels`
};

/// Sums over particles; those of a block are formed in a fixed order, so they do not depend on threads.
struct ParticleSums {
  double speed_squared = 0;      ///< sum v.v, of APIC v.v + dx^2 C:C / 4 [m^2/s^2]
  double max_speed_squared = 0;  ///< [m^2/s^2]
  double max_compression = 0;  ///< bound p + 2/3 q of the largest compressive principal Kirchhoff stress [Pa]
  double plastic_dissipation = 0;  ///< density over the particles that yielded in this step [Pa]
  double yielded = 0;              ///< particles that yielded in this step
  // Below: only when observing.
  double tau[6] = {};    ///< Kirchhoff stress [Pa], xx yy zz xy xz yz
  double q = 0;          ///< von Mises equivalent stress [Pa]
  double tau_J[6] = {};  ///< tau J [Pa], J = det F^E
  double J = 0;
  double elastic_energy = 0;  ///< psi, Eq. 6 [Pa]
  double plastic = 0;         ///< particles with kappa > 0

  void add(const ParticleSums& other);
};

/// What went wrong with which particle (index into the arrays).
struct ParticleFailure {
  std::uint32_t particle;
  const char* quantity;
};

/// Results of one block's pass.
struct BlockResult {
  ParticleSums sums;
  std::vector<std::uint32_t> strays;  ///< particles outside their cell at the end of the pass, ascending
  std::optional<ParticleFailure> failure;
};

/// Raw pointers to the particle arrays.
struct ParticlePointers {
  double *s[3], *v[3], *h[6], *kappa, *affine[9];

  ParticlePointers() = default;
  explicit ParticlePointers(Particles& particles);
};

/// A particle outside the cell under which it is stored.
struct Stray {
  std::uint32_t particle;
  std::uint32_t block;  ///< block of its true cell
  int cell;             ///< its true cell in that block
  Index3 shift;         ///< true cell - storage cell
};

/// Results of the grid update of one leaf, or of all.
struct LeafUpdate {
  double kinetic_before = 0, kinetic_after = 0;  ///< of the nodes [J]
  double max_speed_squared = 0;  ///< after: sum of the largest squares of the components, a bound [m^2/s^2]
  std::uint64_t occupied = 0;    ///< nodes with mass, bit leaf_index; of one leaf
};

/// A leaf as the kernels see it.
struct LeafView {
  std::span<Node* const> partials;  ///< sums to add
  Node* nodes;                      ///< to write
};

/// A block as the kernels see it.
struct BlockView {
  const Node* leaf[8];  ///< nodes to read, null where the particles do not reach
  Node* partial[8];     ///< sums to add to
  const std::uint32_t*
      cell_begin;  ///< 65 entries: particles of cell c are [cell_begin[c], cell_begin[c + 1])
};

/// The kernels of the best instruction set of this CPU. Bits may differ between instruction sets, nothing
/// else does.
struct Kernels {
  std::string simd;  ///< name of the instruction set
  bool full_width;   ///< eight lanes are as fast as four, so that more of them may go unused

  /// Algorithm 1, lines 7-13, then lines 2-4 of the next step, for the particles at home in the block. `next`
  /// is the block to come, for which memory is asked meanwhile.
  void (*advance_block)(PassKind, const StepConstants&, const ParticlePointers&, const BlockView& block,
                        const BlockView& next, bool observe, BlockResult&);
  /// Lines 2-4 alone: at the start of a run.
  void (*scatter_block)(PassKind, const StepConstants&, const ParticlePointers&, const BlockView& block,
                        const BlockView& next, bool observe, BlockResult&);
  /// Lines 7-13 for strays, in their true cells; not for those back home, which their blocks have advanced.
  void (*advance_strays)(PassKind, const StepConstants&, const ParticlePointers&, const SparseGrid&,
                         std::span<const Stray>, BlockResult&);
  /// Lines 2-4 for strays: adds to the sums of the groups of their true cells.
  void (*scatter_strays)(PassKind, const StepConstants&, const ParticlePointers&, const SparseGrid&,
                         std::span<const Stray>, bool observe, ParticleSums&);
  /// Lines 2, 3 and 5 for one leaf: adds its partial sums, which stay as they are, and updates the velocity.
  /// `next` is the leaf to come, for which memory is asked meanwhile.
  LeafUpdate (*update_leaf)(double dt, const LeafView& leaf, const LeafView& next);

  /// Hencky strain of h = b - I: `strain` gets xx yy zz xy xz yz; NaN where b is not positive definite.
  void (*hencky)(std::span<const std::array<double, 6>> h, std::span<std::array<double, 6>> strain);
  /// h of a Hencky strain.
  void (*inverse_hencky)(std::span<const std::array<double, 6>> strain, std::span<std::array<double, 6>> h);
  /// Return mapping of {tr eps, |dev eps|, kappa}; `yielded` may be empty.
  void (*return_mapping)(Model, const MaterialConstants&, std::span<std::array<double, 3>> state,
                         std::span<bool> yielded);
};

const Kernels& kernels();

/// Instruction sets that this CPU has and this build knows, best first.
std::vector<std::string> available_simd();

/// Uses that one instead of the best from now on, for fields and machine limits too; "" for the best. Not
/// while kernels run. @throws InputError  if it is not available
void use_simd(const std::string& name);

}  // namespace anticrack
