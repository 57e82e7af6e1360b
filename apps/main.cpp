#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <new>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "bench.h"
#include "characterize.h"
#include "clean.h"
#include "errors.h"
#include "exit_codes.h"
#include "export.h"
#include "figure.h"
#include "files/atomic_file.h"
#include "generate.h"
#include "import.h"
#include "info.h"
#include "io/provenance.h"
#include "material.h"
#include "nearest_name.h"
#include "precision.h"
#include "run.h"
#if ANTICRACK_RENDER
#include "render.h"
#endif

namespace anticrack {

namespace {

void add_commands(CLI::App& app) {
  add_generate_command(app);
  add_import_command(app);
  add_export_command(app);
  add_characterize_command(app);
  add_clean_command(app);
  add_run_command(app);
#if ANTICRACK_RENDER
  add_render_command(app);
#endif
  add_material_command(app);
  add_figure_command(app);
  add_bench_command(app);
  add_precision_command(app);
  add_info_command(app);
}

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands(nullptr)) names.push_back(command->get_name());
  return names;
}

/// CLI11 says only that a subcommand is required; say which word was none.
void check_command_name(const CLI::App& app, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return;
  const std::vector<std::string> names = command_names(app);
  if (std::find(names.begin(), names.end(), argv[1]) != names.end()) return;
#if !ANTICRACK_RENDER
  if (argv[1] == std::string_view("render"))
    throw InputError("this build has no subcommand render; configure it with -DANTICRACK_RENDER=ON.");
#endif
  const std::string near = nearest_name(argv[1], names);
  throw InputError(near.empty() ? fmt::format("\"{}\" is no subcommand; expected one of: {}.", argv[1],
                                              fmt::join(names, ", "))
                                : fmt::format("\"{}\" is no subcommand; did you mean {}?", argv[1], near));
}

/// "Did you mean --threads?" for the first option that the subcommand does not know.
std::string option_hint(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands()) {
    for (const CLI::Option* option : command->get_options()) {
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
  }
  for (const std::string& argument : app.remaining(true)) {
    if (!argument.starts_with("--")) continue;
    const std::string near = nearest_name(argument.substr(0, argument.find('=')), names);
    if (!near.empty()) return fmt::format(" Did you mean {}?", near);
  }
  return {};
}

int fail(ExitCode code, std::string_view message) {
  fmt::print(stderr, "anticrack: {}\n", message);
  return code;
}

int run_command(int argc, char** argv) {
  CLI::App app("Computational micromechanics of porous brittle solids", "anticrack");
  app.set_version_flag("--version", fmt::format("anticrack {} ({})", program_version(), program_commit()));
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  anticrack generate assets/scenes/quickstart.toml -o sample.vdb\n"
      "  anticrack run assets/scenes/quickstart.toml -o out/run --set loading.until_strain=0.1\n"
      "  anticrack info out/run\n"
      "Exit codes: 0 done, 2 wrong input (nothing written), 3 numerical abort, 4 file error,\n"
      "75 stopped with a checkpoint (run again with --resume).");
  add_commands(app);
  try {
    check_command_name(app, argc, argv);
    app.parse(argc, argv);
    return exit_done;
  } catch (const CLI::ExtrasError& error) {
    return fail(exit_wrong_input, fmt::format("{}.{} See --help.", error.what(), option_hint(app)));
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help and --version
    return fail(exit_wrong_input, fmt::format("{}. See --help.", error.what()));
  }
}

}  // namespace

}  // namespace anticrack

int main(int argc, char** argv) {
  using namespace anticrack;
  std::signal(SIGXFSZ, SIG_IGN);  // a file beyond the user's limit is an error like a full disk
  try {
    const int status = run_command(argc, argv);
    errno = 0;
    if (std::fflush(stdout) != 0 || std::ferror(stdout))
      throw system_file_error("standard output", "cannot be written", errno);
    return status;
  } catch (const InputError& error) {
    return fail(exit_wrong_input, error.what());
  } catch (const NumericalError& error) {
    return fail(exit_numerical_abort, error.what());
  } catch (const FileError& error) {
    return fail(exit_file_error, error.what());
  } catch (const Stopped& error) {
    return fail(exit_stopped, error.what());
  } catch (const std::system_error& error) {
    return fail(exit_file_error, error.what());
  } catch (const std::bad_alloc&) {
    return fail(
        exit_wrong_input,
        "out of memory. Use a smaller sample.resolution; anticrack run --dry-run tells what a scene needs.");
  } catch (const std::exception& error) {  // of a library, not foreseen
    return fail(exit_file_error, fmt::format("unexpected error: {}", error.what()));
  }
}
