#include "generate_many.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <chrono>
#include <limits>
#include <mutex>
#include <thread>

#include "exit_codes.h"
#include "files/atomic_file.h"
#include "output_folder.h"
#include "sample.h"
#include "stop_signal.h"

namespace anticrack {

namespace fs = std::filesystem;

namespace {

constexpr const char* index_name = "index.csv";

struct Realization {
  std::string name;  // of the file within the folder
  std::uint64_t seed;
  double solid_fraction = 0;
  std::size_t solid_points = 0;  // 0: not made yet
};

std::string text_of(const MetadataValue& value) {
  return std::visit([](const auto& held) { return fmt::format("{}", held); }, value);
}

// A file of an earlier run counts if it is what the scene asks for.
void take_finished(const fs::path& file, const SampleScene& scene, const GaussianRandomFieldSource& source,
                   Realization& realization) {
  const Microstructure structure = read_microstructure(file);
  auto expected =
      microstructure_metadata(source.field, source.solid_fraction, source.threshold_rule, source.morphology);
  expected["seed"] = std::to_string(realization.seed);
  for (const auto& [key, value] : expected) {
    const auto found = structure.metadata.find(key);
    if (found == structure.metadata.end() || found->second != value)
      throw InputError(fmt::format(
          "{}: was made with {} = {}, but the scene has {}. Use another -o.", file.string(), key,
          found == structure.metadata.end() ? "nothing" : text_of(found->second), text_of(value)));
  }
  if (structure.lattice.points != scene.lattice->points ||
      structure.lattice.spacing != scene.lattice->spacing)
    throw InputError(
        fmt::format("{}: was made on another lattice than the scene's. Use another -o.", file.string()));
  realization.solid_fraction = structure.solid_fraction();
  realization.solid_points = structure.solid_points;
}

void write_index(const fs::path& folder, const std::vector<Realization>& realizations) {
  std::string text = "file,seed,solid_fraction,solid_points\n";
  for (const Realization& realization : realizations)
    if (realization.solid_points > 0)
      text += fmt::format("{},{},{},{}\n", realization.name, realization.seed, realization.solid_fraction,
                          realization.solid_points);
  write_text_atomically(folder / index_name, text);
}

// Samples at a time: a thread each, as far as the memory goes.
int workers(const RealizationSeries& series) {
  const double fit = machine_memory() / memory_to_generate(series.scene);
  return std::max(1, std::min({series.threads, series.count, int(std::min(fit, 1e6))}));
}

void check_folder(const RealizationSeries& series) {
  const bool again = series.resume && fs::exists(series.folder);
  if (!again) return check_output_folder(series.folder, ExistingFolder::refuse);
  for (const auto& entry : fs::directory_iterator(series.folder)) {
    const std::string name = entry.path().filename().string();
    if (name != index_name && !name.starts_with("seed_") && !name.starts_with('.'))
      throw InputError(
          fmt::format("{}: holds {}, which no series writes. Use another -o.", series.folder.string(), name));
  }
}

}  // namespace

void generate_many(const RealizationSeries& series, const ProgressOptions& progress_options) {
  const auto* source = std::get_if<GaussianRandomFieldSource>(&series.scene.microstructure);
  if (!source)
    throw InputError(
        fmt::format("{}: --count wants microstructure.source = \"gaussian_random_field\", whose "
                    "realizations differ.",
                    series.scene.file.string()));
  if (source->field.seed > std::uint64_t(std::numeric_limits<std::int64_t>::max() - series.count))
    throw InputError(
        fmt::format("{}: microstructure.seed = {} with --count {}; expected the last seed below 2^63.",
                    series.scene.file.string(), source->field.seed, series.count));
  check_folder(series);
  fs::create_directories(series.folder);
  const FolderLock lock(series.folder);

  std::vector<Realization> realizations;
  std::vector<std::size_t> missing;
  for (int n = 0; n < series.count; ++n) {
    const std::uint64_t seed = source->field.seed + std::uint64_t(n);
    Realization& realization = realizations.emplace_back(Realization{fmt::format("seed_{}.vdb", seed), seed});
    const fs::path file = series.folder / realization.name;
    if (fs::exists(file))
      take_finished(file, series.scene, *source, realization);
    else
      missing.push_back(realizations.size() - 1);
  }

  Progress progress(progress_options);
  const StopOnSignal stop;
  const auto start = std::chrono::steady_clock::now();
  std::mutex mutex;
  std::size_t made = 0;
  std::string state_text;
  const auto state = [&] {
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const std::size_t done = realizations.size() - missing.size() + made;
    state_text = fmt::format("{} of {} samples  {:.3g} a minute", done, realizations.size(),
                             seconds > 0 ? 60 * double(made) / seconds : 0.0);
    return ProgressState{.fraction = double(done) / double(realizations.size()), .of_study = state_text};
  };
  const auto make = [&](Realization& realization) {
    SampleScene scene = series.scene;
    std::get<GaussianRandomFieldSource>(scene.microstructure).field.seed = realization.seed;
    const Microstructure structure = load_microstructure(scene);
    write_microstructure(structure, series.folder / realization.name, series.density);
    const std::scoped_lock guard(mutex);
    realization.solid_fraction = structure.solid_fraction();
    realization.solid_points = structure.solid_points;
    ++made;
    progress.update(state());
  };

  // A worker takes the next that is missing until none is left; nothing inside a sample runs on other
  // threads.
  std::atomic<std::size_t> next = 0;
  std::exception_ptr failure;
  const int at_once = workers(series), threads_each = std::max(1, series.threads / at_once);
  std::vector<std::thread> pool;
  for (int worker = 0; worker < at_once; ++worker)
    pool.emplace_back([&] {
      tbb::task_arena arena(threads_each);
      for (std::size_t n = next++; n < missing.size() && !stop.requested(); n = next++) {
        try {
          arena.execute([&] { make(realizations[missing[n]]); });
        } catch (...) {
          const std::scoped_lock guard(mutex);
          if (!failure) failure = std::current_exception();
          next = missing.size();
        }
      }
    });
  for (std::thread& thread : pool) thread.join();

  write_index(series.folder, realizations);
  if (failure) std::rethrow_exception(failure);
  progress.finish(state(), fmt::format("{}: {} made, {} were there", series.folder.string(), made,
                                       realizations.size() - missing.size()));
  if (made < missing.size())
    throw Stopped(
        fmt::format("stopped by a signal: {} of {} samples are missing. Make them with the same command and "
                    "--resume.",
                    missing.size() - made, realizations.size()));
}

}  // namespace anticrack
