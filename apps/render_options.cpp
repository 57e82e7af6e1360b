#include "render_options.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "errors.h"

namespace anticrack {

namespace {

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  while (true) {
    const std::size_t end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

std::array<double, 2> parse_pair(std::string_view option, std::string_view text, std::string_view expected) {
  const std::vector<double> v = parse_numbers(option, text);
  if (v.size() != 2) throw InputError(fmt::format("{} {}: expected {}.", option, text, expected));
  return {v[0], v[1]};
}

CutRequest parse_cut(std::string_view text) {
  CutRequest request;
  if (text.size() > 2 && text[1] == '=' && text[0] >= 'x' && text[0] <= 'z') {
    const std::vector<double> v = parse_numbers("--cut", text.substr(2));
    if (v.size() == 1) {
      request.plane.normal[std::size_t(text[0] - 'x')] = 1;
      request.plane.offset = float(v[0]);
      request.towards_camera = true;
      return request;
    }
  } else if (const std::vector<double> v = parse_numbers("--cut", text); v.size() == 4) {
    const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    if (!(length > 0)) throw InputError(fmt::format("--cut {}: the normal has no length.", text));
    for (std::size_t c = 0; c < 3; ++c) request.plane.normal[c] = float(v[c] / length);
    request.plane.offset = float(v[3] / length);
    return request;
  }
  throw InputError(
      fmt::format("--cut {}: expected x=D, y=D or z=D (metres; the half towards the camera goes), or "
                  "NX,NY,NZ,D (what has "
                  "n . x > D goes).",
                  text));
}

template <class Choice>
Choice choose(std::string_view option, std::string_view text,
              const std::array<std::pair<std::string_view, Choice>, 2>& choices) {
  for (const auto& [name, choice] : choices) {
    if (name == text) return choice;
  }
  throw InputError(
      fmt::format("{} {}: expected {} or {}.", option, text, choices[0].first, choices[1].first));
}

}  // namespace

std::vector<double> parse_numbers(std::string_view option, std::string_view text) {
  std::vector<double> numbers;
  for (const std::string_view part : split(text, ',')) {
    double value = 0;
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
    if (error != std::errc{} || end != part.data() + part.size() || !std::isfinite(value)) {
      throw InputError(fmt::format("{} {}: \"{}\" is not a number.", option, text, part));
    }
    numbers.push_back(value);
  }
  return numbers;
}

CutPlane CutRequest::facing(const Camera& camera) const {
  CutPlane facing = plane;
  const Vec3 normal(plane.normal[0], plane.normal[1], plane.normal[2]);
  if (towards_camera && normal.dot(camera.direction()) > 0) {
    for (float& n : facing.normal) n = -n;
    facing.offset = -facing.offset;
  }
  return facing;
}

RenderSettings parse_settings(const RenderArguments& arguments) {
  RenderSettings settings;
  settings.renderer = choose<Renderer>("--renderer", arguments.renderer,
                                       {{{"embree", Renderer::embree}, {"osmesa", Renderer::osmesa}}});
  settings.mode = choose<DrawMode>("--mode", arguments.mode,
                                   {{{"surface", DrawMode::surface}, {"spheres", DrawMode::spheres}}});
  if (!arguments.cut.empty()) settings.cut = parse_cut(arguments.cut);
  if (!arguments.range.empty()) {
    settings.range = parse_pair("--range", arguments.range, "LOW,HIGH");
    if (!((*settings.range)[1] > (*settings.range)[0])) {
      throw InputError(fmt::format("--range {}: expected LOW < HIGH.", arguments.range));
    }
  }
  if (!arguments.size.empty()) {
    const std::vector<std::string_view> parts = split(arguments.size, 'x');
    if (parts.size() == 2) {
      settings.size = {parse_numbers("--size", parts[0])[0], parse_numbers("--size", parts[1])[0]};
    }
    const auto whole = [](double v) { return v >= 1 && v <= 16384 && v == std::floor(v); };
    if (!settings.size || !whole((*settings.size)[0]) || !whole((*settings.size)[1])) {
      throw InputError(
          fmt::format("--size {}: expected WIDTHxHEIGHT in whole pixels, at most 16384.", arguments.size));
    }
  }
  if (!arguments.view.empty()) {
    const auto [azimuth, elevation] = parse_pair("--view", arguments.view, "AZIMUTH,ELEVATION in degrees");
    if (!(std::abs(elevation) < 90)) {
      throw InputError(
          fmt::format("--view {}: expected an elevation between -90 and 90 degrees.", arguments.view));
    }
    settings.view = {azimuth, elevation};
  }
  if (arguments.samples < 1 || arguments.samples > 1024) {
    throw InputError(fmt::format("--samples {}: expected 1 to 1024 rays a pixel.", arguments.samples));
  }
  settings.samples = arguments.samples;
  if (!(arguments.percentile > 0 && arguments.percentile <= 100)) {
    throw InputError(fmt::format("--percentile {}: expected 0 < percentile <= 100.", arguments.percentile));
  }
  if (!(arguments.frames_per_second > 0 && arguments.frames_per_second <= 240)) {
    throw InputError(fmt::format("--fps {}: expected 0 < fps <= 240.", arguments.frames_per_second));
  }
  return settings;
}

}  // namespace anticrack
