#include "render.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>

#include "annotation.h"
#include "errors.h"
#include "files/atomic_file.h"
#include "output_folder.h"
#include "panel.h"
#include "render_frames.h"
#include "render_movie.h"
#include "render_options.h"
#include "render_picture.h"
#include "render_plot.h"

namespace anticrack {

namespace {

namespace fs = std::filesystem;

constexpr int default_height = 1440;
constexpr int default_panel_width = 420;  // of one picture

/// Everything that all kinds of pictures need.
struct Job {
  const RenderArguments& arguments;
  RenderSettings settings;
  const RenderField& field;
  Progress progress;

  explicit Job(const RenderArguments& arguments)
      : arguments(arguments),
        settings(parse_settings(arguments)),
        field(find_field(arguments.field)),
        progress(arguments.progress()) {}

  ScaleChooser scale_chooser() const {
    return ScaleChooser({field.is_signed, arguments.logarithmic, arguments.percentile, settings.range});
  }

  Frame read(const fs::path& file) {
    const auto start = std::chrono::steady_clock::now();
    Frame frame = read_frame(file);
    if (frame.position.empty())
      throw InputError(fmt::format("{}: the frame holds no particles.", file.string()));
    progress.message(
        fmt::format("{}: {} particles, read {:.2f} s", file.string(), frame.position.size(),
                    std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()));
    return frame;
  }

  void write(const std::string& bytes) const {
    fs::create_directories(fs::absolute(arguments.output).parent_path());
    write_text_atomically(arguments.output, bytes);
  }

  Image draw(const Frame& frame, const ColorScale& scale, const Camera& camera) {
    return draw_frame(frame, field, scale, camera, settings,
                      [this](std::string_view text) { progress.message("  " + std::string(text)); });
  }
};

int even(double length) {
  return 2 * int(std::lround(length / 2));
}

/// Width and height of an annotated picture that fits the sample, unless the user fixed them.
std::array<int, 2> picture_size(const Job& job, const Box& box, const Annotation& annotation) {
  if (job.settings.size) return {int((*job.settings.size)[0]), int((*job.settings.size)[1])};
  const double aspect = Camera::aspect(box, job.settings.view);
  const int width = even(std::clamp(aspect * default_height, 900.0, double(default_height)));
  const AnnotationLayout layout = layout_annotation(width, default_height, annotation);
  const double body = std::clamp(width / aspect, 0.4 * width, layout.picture.height);
  return {width, even(default_height - layout.picture.height + body)};
}

Annotation annotation_of(const Job& job, const ColorScale& scale, const FrameHeader& header) {
  const std::string& title = job.arguments.title;
  return {scale, std::string(job.field.label), strain_label(header),
          title == "none" ? ""
          : title.empty() ? plain_text(header.run)
                          : plain_text(title)};
}

std::string draw_annotated(Job& job, const Frame& frame, const ColorScale& scale, const Box& box,
                           const std::array<int, 2>& size) {
  const Annotation annotation = annotation_of(job, scale, frame.header);
  const AnnotationLayout layout = layout_annotation(size[0], size[1], annotation);
  const Camera camera =
      Camera::fit(box, job.settings.view, int(layout.picture.width), int(layout.picture.height));
  const Image picture = job.draw(frame, scale, camera);
  return encode_png(annotate(size[0], size[1], picture, camera.pixel_size(), annotation),
                    picture_text(frame.header, job.field, scale, job.settings, job.arguments));
}

void render_still(Job& job) {
  const RunFrames run(job.arguments.inputs.front());
  const Frame frame = job.read(run.file(job.arguments.frame));
  ScaleChooser chooser = job.scale_chooser();
  chooser.include(field_values(frame, job.field));
  const ColorScale scale = chooser.choose();
  const Box box = frame_box(frame);
  const auto size = picture_size(job, box, annotation_of(job, scale, frame.header));
  job.write(draw_annotated(job, frame, scale, box, size));
}

/// Rows of a panel: which frame of each run.
std::vector<fs::path> panel_files(const Job& job, const std::vector<RunFrames>& runs, std::size_t& rows) {
  std::vector<fs::path> files;
  const RenderArguments& arguments = job.arguments;
  if (!arguments.strains.empty()) {
    const std::vector<double> strains = parse_numbers("--strains", arguments.strains);
    rows = strains.size();
    for (const double strain : strains) {
      for (const RunFrames& run : runs) files.push_back(run.closest(std::abs(strain)));
    }
    return files;
  }
  std::vector<std::string> frames;
  const std::string list = arguments.frames.empty() ? arguments.frame : arguments.frames;
  for (std::size_t from = 0; from <= list.size();) {
    const std::size_t end = std::min(list.find(',', from), list.size());
    frames.push_back(list.substr(from, end - from));
    from = end + 1;
  }
  rows = frames.size();
  for (const std::string& frame : frames) {
    for (const RunFrames& run : runs) files.push_back(run.file(frame));
  }
  return files;
}

void render_panel(Job& job) {
  std::vector<RunFrames> runs;
  for (const std::string& input : job.arguments.inputs) runs.emplace_back(input);
  std::size_t rows = 0;
  const std::vector<fs::path> files = panel_files(job, runs, rows);

  // First over all frames for what the pictures share; a series of large frames would not fit into memory at
  // once.
  Panel panel;
  ScaleChooser chooser = job.scale_chooser();
  Box box;
  FrameHeader first;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const Frame frame = job.read(files[i]);
    chooser.include(field_values(frame, job.field));
    box = i == 0 ? frame_box(frame) : box.united(frame_box(frame));
    if (i == 0) first = frame.header;
    if (i < runs.size())
      panel.column_titles.push_back(plain_text(frame.header.run.empty() ? runs[i].name() : frame.header.run));
    if (i % runs.size() == 0) panel.row_labels.push_back(strain_label(frame.header));
  }
  const ColorScale scale = chooser.choose();
  panel.annotation = {scale, std::string(job.field.label), "", plain_text(job.arguments.title)};
  const int width = job.settings.size ? int((*job.settings.size)[0]) : default_panel_width;
  const int height =
      job.settings.size
          ? int((*job.settings.size)[1])
          : even(std::clamp(width / Camera::aspect(box, job.settings.view), 0.4 * width, 3.0 * width));
  layout_panel(panel, width, height);  // refuses what does not fit before the long part
  const Camera camera = Camera::fit(box, job.settings.view, width, height, 0.03);
  std::vector<Image> pictures;
  for (const fs::path& file : files) pictures.push_back(job.draw(job.read(file), scale, camera));
  job.write(encode_png(compose_panel(panel, pictures, camera.pixel_size()),
                       picture_text(first, job.field, scale, job.settings, job.arguments)));
}

void render_movie(Job& job) {
  const RunFrames run(job.arguments.inputs.front());
  const fs::path movie = job.arguments.movie;
  const fs::path folder = movie.parent_path() / (movie.stem().string() + "_frames");

  // One range and one camera for all frames: what moves in the movie moves in the sample.
  ScaleChooser chooser = job.scale_chooser();
  Box box;
  FrameHeader last;
  for (std::size_t i = 0; i < run.files().size(); ++i) {
    const Frame frame = job.read(run.files()[i].second);
    chooser.include(field_values(frame, job.field));
    box = i == 0 ? frame_box(frame) : box.united(frame_box(frame));
    last = frame.header;
  }
  const ColorScale scale = chooser.choose();
  auto size = picture_size(job, box, annotation_of(job, scale, last));
  for (int& length : size) length = even(length);  // yuv420p halves both

  fs::create_directories(folder);
  for (std::size_t i = 0; i < run.files().size(); ++i) {
    const Frame frame = job.read(run.files()[i].second);
    write_text_atomically(folder / fmt::format("frame_{:04d}.png", i),
                          draw_annotated(job, frame, scale, box, size));
  }
  if (encode_movie(folder, movie, job.arguments.frames_per_second)) {
    job.progress.message(fmt::format("{}: {} frames", movie.string(), run.files().size()));
  } else {
    job.progress.message(fmt::format(
        "ffmpeg is not installed; the pictures are in {}. Make the movie where it is:\n  {}", folder.string(),
        shell_line(ffmpeg_command(folder, movie, job.arguments.frames_per_second))));
  }
}

void render(const RenderArguments& arguments) {
  // Refuse what cannot work before the work.
  const int kinds = int(arguments.panel) + int(arguments.plot) + int(!arguments.movie.empty());
  if (kinds > 1) throw InputError("--panel, --plot and --movie exclude each other.");
  const bool movie = !arguments.movie.empty();
  if (movie == !arguments.output.empty()) {
    throw InputError(movie ? "--movie names the file itself; leave -o out."
                           : "expected -o IMAGE (or --movie M.mp4).");
  }
  const std::string& output = movie ? arguments.movie : arguments.output;
  if (movie ? !output.ends_with(".mp4") : !arguments.plot && !output.ends_with(".png")) {
    throw InputError(fmt::format("{}: expected a name that ends in {}.", output, movie ? ".mp4" : ".png"));
  }
  if (!arguments.panel && !arguments.plot && arguments.inputs.size() != 1) {
    throw InputError(fmt::format("got {} runs; several need --panel or --plot.", arguments.inputs.size()));
  }
  if (!arguments.panel && !(arguments.frames.empty() && arguments.strains.empty())) {
    throw InputError("--frames and --strains choose the rows of a --panel; a still takes --frame.");
  }
  if (!arguments.frames.empty() && !arguments.strains.empty()) {
    throw InputError("--frames and --strains exclude each other.");
  }
  Job job(arguments);
  job.scale_chooser();
  check_output_file(output, true);
  const ThreadLimit limit(thread_count(arguments));
  const auto start = std::chrono::steady_clock::now();
  if (arguments.plot) {
    const auto size = job.settings.size.value_or(std::array{1200.0, 840.0});
    const std::string bytes = plot_histories(arguments.inputs, arguments.plot_x, arguments.plot_y, output,
                                             int(size[0]), int(size[1]));
    job.write(bytes);
  } else if (arguments.panel) {
    render_panel(job);
  } else if (movie) {
    render_movie(job);
  } else {
    render_still(job);
  }
  job.progress.message(
      fmt::format("{}: {:.1f} s", output,
                  std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()));
}

}  // namespace

CLI::App* add_render_command(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("render", "Images, panels, movies and plots of a run, without display");
  auto options = std::make_shared<RenderArguments>();
  RenderArguments& a = *options;
  command->add_option("input", a.inputs, "Run folder or frame file; several for --panel and --plot")
      ->required()
      ->type_name("DIR_or_FRAME");
  command->add_option("-o,--output", a.output, "Picture to write (.png; a plot also .svg or .pdf)")
      ->type_name("IMAGE");
  command->add_option("--frame", a.frame, "Index of the frame, or last")
      ->type_name("N")
      ->capture_default_str();
  command
      ->add_option(
          "--field", a.field,
          "Colour by kappa, dkappa, kappa_rate, velocity_x, velocity_y, velocity_z, speed, pressure or "
          "von_mises")
      ->capture_default_str();
  command->add_option("--renderer", a.renderer, "embree (final) or osmesa (fast preview)")
      ->capture_default_str();
  command->add_option("--mode", a.mode, "surface or spheres (every particle as it is)")
      ->capture_default_str();
  command->add_option("--cut", a.cut, "Look inside: x=D, y=D, z=D [m], or NX,NY,NZ,D")->type_name("PLANE");
  command->add_option("--range", a.range, "Fixed colour range, in the colour bar's unit")
      ->type_name("LOW,HIGH");
  command->add_option("--percentile", a.percentile, "Upper end of the colour range otherwise")
      ->capture_default_str();
  command->add_flag("--log", a.logarithmic, "Logarithmic colour scale");
  command->add_option("--size", a.size, "Pixels; of one picture in a panel")->type_name("WxH");
  command->add_option("--view", a.view, "Azimuth and elevation of the camera [degrees]")->type_name("AZ,EL");
  command->add_option("--samples", a.samples, "Rays a pixel")->capture_default_str();
  command->add_option("--title", a.title,
                      "Text above the picture instead of the run's name; none for nothing");
  command->add_flag("--panel", a.panel, "Runs side by side (columns), frames below each other (rows)");
  command->add_option("--frames", a.frames, "Rows of a panel by index")->type_name("N,N,...");
  command->add_option("--strains", a.strains, "Rows of a panel by nominal strain")->type_name("E,E,...");
  command->add_flag("--plot", a.plot, "Plot columns of history.csv");
  command->add_option("--x", a.plot_x, "Abscissa of a plot (--x=-strain_y for its negative)")
      ->type_name("COLUMN");
  command->add_option("--y", a.plot_y, "Ordinates of a plot, p,q if not given")->type_name("COLUMN,...");
  command->add_option("--movie", a.movie, "Every frame as a movie; needs ffmpeg, or tells its command")
      ->type_name("M.mp4");
  command->add_option("--fps", a.frames_per_second, "Frames a second of a movie")->capture_default_str();
  add_threads_option(*command, a);
  add_progress_options(*command, a);
  command->footer(
      "Examples:\n"
      "  anticrack render out/run -o kappa.png\n"
      "  anticrack render out/run -o inside.png --cut z=0.5 --frame 12 --renderer osmesa\n"
      "  anticrack render out/phi024 out/phi034 -o panel.png --panel --strains 0.004,0.11 --field "
      "velocity_y\n"
      "  anticrack render out/phi024 out/phi034 -o stress.pdf --plot --y p\n"
      "  anticrack render out/run --movie run.mp4 --range 0,1.5");
  command->callback([options] { render(*options); });
  return command;
}

}  // namespace anticrack
