#include "material.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "common_options.h"
#include "errors.h"
#include "files/atomic_file.h"
#include "material/material_point.h"
#include "output_folder.h"
#include "scene.h"

namespace anticrack {

namespace {

struct MaterialOptions : CommonOptions {
  std::string scene, path, output;
  double kappa0 = 0;
  bool force = false;
};

const std::vector<std::string> strain_columns = {"e1", "e2", "e3"};
const std::vector<std::string> gradient_columns = {"F11", "F12", "F13", "F21", "F22",
                                                   "F23", "F31", "F32", "F33"};

struct Path {
  bool gradients;                         ///< nine columns of F, else three of strain
  std::vector<std::vector<double>> rows;  ///< in the order of the columns above
};

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> fields;
  std::stringstream in(line);
  for (std::string field; std::getline(in, field, ',');) {
    const auto first = field.find_first_not_of(" \t\r"), last = field.find_last_not_of(" \t\r");
    fields.push_back(first == std::string::npos ? "" : field.substr(first, last - first + 1));
  }
  return fields;
}

Path read_path(const std::string& file) {
  std::ifstream in(file);
  if (!in) throw FileError(fmt::format("{}: cannot be opened for reading.", file));
  std::string line;
  std::getline(in, line);
  const std::vector<std::string> names = split(line);
  const auto place = [&](const std::vector<std::string>& wanted) {
    std::vector<std::size_t> at;
    for (const std::string& name : wanted)
      for (std::size_t i = 0; i < names.size(); ++i)
        if (names[i] == name) at.push_back(i);
    return at;
  };
  Path path{place(gradient_columns).size() == 9, {}};
  const std::vector<std::string>& wanted = path.gradients ? gradient_columns : strain_columns;
  const std::vector<std::size_t> at = place(wanted);
  if (at.size() != wanted.size())
    throw InputError(fmt::format("{}:1: columns {}; expected e1,e2,e3 or F11,F12,...,F33.", file, line));
  for (int number = 2; std::getline(in, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    const std::vector<std::string> fields = split(line);
    std::vector<double> row;
    for (std::size_t c = 0; c < at.size(); ++c) {
      const std::string field = at[c] < fields.size() ? fields[at[c]] : "";
      char* end = nullptr;
      row.push_back(std::strtod(field.c_str(), &end));
      if (field.empty() || *end != '\0')
        throw InputError(
            fmt::format("{}:{}: {} = \"{}\"; expected a number.", file, number, wanted[c], field));
      if (!path.gradients && !(std::abs(row.back()) <= 100))
        throw InputError(fmt::format("{}:{}: {} = {}; expected a Hencky strain from -100 to 100.", file,
                                     number, wanted[c], field));
    }
    path.rows.push_back(row);
  }
  if (path.rows.empty()) throw InputError(fmt::format("{}: no rows; expected at least one.", file));
  return path;
}

std::string drive_strain(const MaterialScene& scene, const Path& path, double kappa) {
  constexpr const char* branch_names[] = {"elastic", "cone", "apex"};
  std::string out = "e1,e2,e3,kappa,p,q,branch\n";
  PrincipalState state;
  state.kappa = kappa;
  Vec3 before = Vec3::Zero();
  for (const auto& row : path.rows) {
    const Vec3 total(row[0], row[1], row[2]);
    state =
        return_principal(scene.material, scene.return_mapping, state.strain + (total - before), state.kappa);
    before = total;
    out +=
        fmt::format("{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{}\n", state.strain[0], state.strain[1],
                    state.strain[2], state.kappa, mean_stress(scene.material, state.strain),
                    von_mises(scene.material, state.strain), branch_names[int(state.branch)]);
  }
  return out;
}

std::string drive_gradient(const MaterialScene& scene, const Path& path) {
  std::string out =
      "eps11,eps22,eps33,eps12,eps13,eps23,tau11,tau22,tau33,tau12,tau13,tau23,p,q,psi,status\n";
  for (const auto& row : path.rows) {
    Mat3 F;
    F << row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8];
    const auto state = hencky_state(scene.material.elasticity, F);
    if (!state) {
      out += std::string(15, ',') + "REFUSE\n";
      continue;
    }
    out += fmt::format("{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},OK\n", fmt::join(state->strain, ","),
                       fmt::join(state->tau, ","), state->p, state->q, state->psi);
  }
  return out;
}

void material(const MaterialOptions& options) {
  const MaterialScene scene = read_material_scene(options.scene, options.set);
  const Path path = read_path(options.path);
  if (!(options.kappa0 >= 0))
    throw InputError(fmt::format("--kappa0 {}; expected a number >= 0.", options.kappa0));
  check_output_file(options.output, options.force);
  write_text_atomically(options.output, path.gradients ? drive_gradient(scene, path)
                                                       : drive_strain(scene, path, options.kappa0));
}

}  // namespace

CLI::App* add_material_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "material", "Drive one material point along a strain or deformation path, without a grid");
  auto options = std::make_shared<MaterialOptions>();
  command
      ->add_option("scene", options->scene,
                   "Scene file (TOML); only [material] and numerics.return_mapping matter")
      ->required()
      ->type_name("SCENE");
  command
      ->add_option("--path", options->path,
                   "Columns e1,e2,e3 (total principal Hencky strain after each step) or F11,...,F33")
      ->required()
      ->type_name("P.csv");
  command->add_option("-o,--output", options->output, "File to write")->required()->type_name("OUT.csv");
  command->add_option("--kappa0", options->kappa0, "Accumulated plastic strain at the start");
  command->add_flag("--force", options->force, "Replace an existing file");
  add_set_option(*command, *options);
  command->footer(
      "The plastic step of e1,e2,e3 is the engine's own return mapping; F is taken as elastic. A row of F "
      "with det F <= 0 or a\n"
      "number that is not finite gets the status REFUSE.\n"
      "Example:\n"
      "  anticrack material assets/scenes/paper_triaxial.toml --path path.csv -o state.csv --set "
      "material.softening=1000");
  command->callback([options] { material(*options); });
  return command;
}

}  // namespace anticrack
