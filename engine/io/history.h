#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <vector>

namespace anticrack {

/// One line of history.csv. A value that a run cannot give is not-a-number.
///
/// Stresses are averages over the whole sample box, solid and void, unless said otherwise; p is positive in
/// compression, the components of sigma and the strains in tension.
struct HistoryRow {
  double step = 0;
  double time = 0;               ///< [s]
  double dt = 0;                 ///< [s] of this step
  double strain_x = 0;           ///< nominal strain of the box [-]
  double strain_y = 0;           ///< [-]
  double strain_z = 0;           ///< [-]
  double p = 0;                  ///< mean stress [Pa]
  double q = 0;                  ///< average of the particles' q [Pa]
  double q_of_mean = 0;          ///< q of the average stress [Pa]
  double p_paper = 0;            ///< the paper's own average over the solid, times its fraction [Pa]
  double q_paper = 0;            ///< [Pa]
  double sigma_xx = 0;           ///< average Cauchy stress [Pa]
  double sigma_yy = 0;           ///< [Pa]
  double sigma_zz = 0;           ///< [Pa]
  double sigma_xy = 0;           ///< [Pa]
  double sigma_xz = 0;           ///< [Pa]
  double sigma_yz = 0;           ///< [Pa]
  double wall_force_x0 = 0;      ///< normal force of the lower x wall [N], from the impulse that enforces it
  double wall_force_x1 = 0;      ///< of the upper x wall [N]
  double wall_force_y0 = 0;      ///< [N]
  double wall_force_y1 = 0;      ///< [N]
  double wall_force_z0 = 0;      ///< [N]
  double wall_force_z1 = 0;      ///< [N]
  double second_order_work = 0;  ///< Eq. 9, > 0 in elastic loading
  double kinetic_energy = 0;     ///< [J]
  double elastic_energy = 0;     ///< [J]
  double plastic_dissipation = 0;    ///< [J] since the start
  double numerical_dissipation = 0;  ///< [J] since the start
  double wall_work = 0;              ///< [J] done by the walls since the start
  double energy_residual = 0;   ///< what the balance of the five above lacks, all at one time, relative [-]
  double solid_fraction = 0;    ///< of the current box [-]
  double plastic_fraction = 0;  ///< share of particles that have yielded [-]
  double strays = 0;            ///< share of particles outside their block's order [-]
  double active_leaves = 0;     ///< leaves of the grid
  double wall_seconds = 0;      ///< run time since the start [s]
};

struct HistoryColumn {
  std::string_view name;
  double HistoryRow::*value;
};

/// The columns of history.csv in order: the one list behind header, writer and reader.
inline constexpr auto history_columns = std::to_array<HistoryColumn>({
    {"step", &HistoryRow::step},
    {"time", &HistoryRow::time},
    {"dt", &HistoryRow::dt},
    {"strain_x", &HistoryRow::strain_x},
    {"strain_y", &HistoryRow::strain_y},
    {"strain_z", &HistoryRow::strain_z},
    {"p", &HistoryRow::p},
    {"q", &HistoryRow::q},
    {"q_of_mean", &HistoryRow::q_of_mean},
    {"p_paper", &HistoryRow::p_paper},
    {"q_paper", &HistoryRow::q_paper},
    {"sigma_xx", &HistoryRow::sigma_xx},
    {"sigma_yy", &HistoryRow::sigma_yy},
    {"sigma_zz", &HistoryRow::sigma_zz},
    {"sigma_xy", &HistoryRow::sigma_xy},
    {"sigma_xz", &HistoryRow::sigma_xz},
    {"sigma_yz", &HistoryRow::sigma_yz},
    {"wall_force_x0", &HistoryRow::wall_force_x0},
    {"wall_force_x1", &HistoryRow::wall_force_x1},
    {"wall_force_y0", &HistoryRow::wall_force_y0},
    {"wall_force_y1", &HistoryRow::wall_force_y1},
    {"wall_force_z0", &HistoryRow::wall_force_z0},
    {"wall_force_z1", &HistoryRow::wall_force_z1},
    {"second_order_work", &HistoryRow::second_order_work},
    {"kinetic_energy", &HistoryRow::kinetic_energy},
    {"elastic_energy", &HistoryRow::elastic_energy},
    {"plastic_dissipation", &HistoryRow::plastic_dissipation},
    {"numerical_dissipation", &HistoryRow::numerical_dissipation},
    {"wall_work", &HistoryRow::wall_work},
    {"energy_residual", &HistoryRow::energy_residual},
    {"solid_fraction", &HistoryRow::solid_fraction},
    {"plastic_fraction", &HistoryRow::plastic_fraction},
    {"strays", &HistoryRow::strays},
    {"active_leaves", &HistoryRow::active_leaves},
    {"wall_seconds", &HistoryRow::wall_seconds},
});
static_assert(sizeof(HistoryRow) == history_columns.size() * sizeof(double), "a member without its column");

/// Appends rows to history.csv; numbers are the shortest that read back to the same double.
class HistoryWriter {
 public:
  /// Starts a new file, replacing one that exists. @throws FileError
  explicit HistoryWriter(const std::filesystem::path& file);

  /// Continues a file after `keep_up_to_step`: later rows and a torn last one are dropped, atomically.
  /// @throws FileError
  HistoryWriter(const std::filesystem::path& file, std::int64_t keep_up_to_step);

  /// Hands the whole row to the system before it returns, so that a crash leaves whole rows. @throws
  /// FileError
  void append(const HistoryRow& row);

  /// Returns once all rows are on disk. @throws FileError
  void flush_to_disk();

 private:
  void open();

  std::filesystem::path file_;
  std::ofstream stream_;
};

/// All whole rows of a history.csv; a last line without its end, as a running or killed run leaves it, is
/// overlooked.
/// @throws FileError  naming the line and column of what is wrong
std::vector<HistoryRow> read_history(const std::filesystem::path& file);

}  // namespace anticrack
