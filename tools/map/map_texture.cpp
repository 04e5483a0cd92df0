// `parhelion map texture`: what a site looks like, from recorded camera images.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>

#include "fusion/semantic/texture/build_texture.hpp"
#include "render/jpeg.hpp"
#include "tools/map/image_frames.hpp"
#include "tools/map/map_commands.hpp"
#include "tools/progress.hpp"
#include "tools/text_file.hpp"

namespace parhelion::tools {
namespace {

namespace fs = std::filesystem;

constexpr int kQuality = 92;  ///< of the picture's JPEG
constexpr int kStages = 3;

constexpr const char* kDescription =
    "Make the texture of a site's model from camera images: what the site looks like";
constexpr const char* kFooter =
    "Example:\n  parhelion map texture kitchen.yaml --log kitchen.lcm\n\n"
    "LOG has CAMERA images, poses in the model's map (POSE_COV or POSE) and a robot description; DEPTH "
    "images "
    "make\nthe surface exact, without them it is the model's. The texture lies beside the model, as "
    "kitchen.texture: there serve\nfinds it, and simulated cameras show the site as it was recorded. What no "
    "image shows is striped.";

struct Arguments {
  std::string model, log, output;
  ImageFrameOptions frames;
  semantic::TextureOptions texture;
  bool overwrite = false;
};

void print_note(const std::string& note) {
  std::fprintf(stderr, "parhelion map texture: %s\n", note.c_str());
}

/// Patches are as large as the blocks of a JPEG: none of its blocks holds two that are not neighbours.
Result<std::vector<std::uint8_t>> encode(const semantic::BuiltTexture& built) {
  std::vector<std::uint8_t> bgr = built.rgb;
  for (std::size_t i = 0; i + 2 < bgr.size(); i += 3) std::swap(bgr[i], bgr[i + 2]);
  render::JpegCodec codec;
  return codec.encode(bgr, {built.width, built.height, kQuality, render::JpegFormat::Subsampling::yuv444});
}

Result<semantic::BuiltTexture> build(const Arguments& a, const SemanticModel& model, ImageFrames frames) {
  Progress progress("map texture", "stages");
  int stage = 0;
  auto built = semantic::build_texture(model, std::move(frames.colour), std::move(frames.depth), a.texture,
                                       [&](const char*) { progress.update(stage++, kStages); });
  progress.finish();
  return built;
}

/// What is wrong with the calibration or the poses, and what to do.
void warn(const semantic::BuiltTexture& built) {
  constexpr double kFocal = 0.02, kDistortion = 0.05, kMoved = 0.04;
  const semantic::LensError& lens = built.lens;
  char text[400];
  if (std::abs(lens.focal - 1) > kFocal || std::abs(lens.distortion) > kDistortion) {
    std::snprintf(
        text, sizeof text,
        "warning: the images do not fit the camera's calibration. They agree best with fx and fy times "
        "%.3f and %+.2f to the first value of distortion, which this texture has; correct the robot "
        "description, since everything else uses it",
        lens.focal, lens.distortion);
    print_note(text);
  }
  if (built.moved > kMoved) {
    print_note(
        "warning: the images had to be moved far until they agreed. Check the poses, the camera's pose on "
        "the "
        "robot and its time_offset; `parhelion calibrate` estimates the time_offset");
  }
}

void report(const Arguments& a, const semantic::BuiltTexture& built, double seconds) {
  const auto share = [&](std::size_t part) {
    return 100.0 * static_cast<double>(part) / static_cast<double>(built.texture.quads.size());
  };
  std::fprintf(stderr,
               "%s: %zu pieces of surface, %.0f %% measured by depth images, %.0f %% seen by a camera; poses "
               "of images moved by %.1f cm (median); picture %dx%d; %.1f s\n",
               a.output.c_str(), built.texture.quads.size(), share(built.measured), share(built.seen),
               100 * built.moved, built.width, built.height, seconds);
  if (built.with_movers > 0)
    print_note("people or things that moved were left out of " + std::to_string(built.with_movers) +
               " images: other images see through them");
  warn(built);
}

Status run(Arguments& a) {
  const auto start = std::chrono::steady_clock::now();
  if (a.output.empty()) a.output = texture_beside(a.model);
  if (fs::path(a.output).extension() != ".texture")
    return Error{a.output + ": expected a name that ends in .texture"};
  if (const Status free = check_writable(a.output, a.overwrite); !free) return free;
  const auto model = load_model(a.model);
  if (!model) return model.error();
  auto frames = read_image_frames(a.log, a.frames);
  if (!frames) return frames.error();
  for (const std::string& note : frames->notes) print_note(note);
  if (frames->depth.empty())
    print_note(a.log +
               ": has no DEPTH images: colours are laid onto the model's own surfaces, and objects are "
               "as coarse as it has them");
  const std::string source = fs::path(a.log).filename().string() + ", " +
                             std::to_string(frames->colour.size()) + " images, " +
                             std::to_string(frames->depth.size()) + " depth images";
  auto built = build(a, *model, std::move(*frames));
  if (!built) return Error{a.log + ": " + built.error().message};
  built->texture.source = source;
  auto jpeg = encode(*built);
  if (!jpeg) return jpeg.error();
  built->texture.jpeg = std::move(*jpeg);
  const fs::path path = a.output;
  const Status written = write_beside(path, {path.filename().string()}, [&](const fs::path& folder) {
    return write_site_texture((folder / path.filename()).string(), built->texture);
  });
  if (!written) return written;
  report(a, *built, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  if (texture_beside(a.model) != a.output)
    print_note("serve looks for " + texture_beside(a.model) + " beside the model");
  return {};
}

void add_options(CLI::App& command, Arguments& a) {
  command.add_option("MODEL", a.model, "Semantic model (YAML)")->required();
  command.add_option("--log", a.log, "LCM log with CAMERA images and poses")->required();
  command.add_option("-o,--output", a.output, "Texture to write (.texture; default: beside MODEL)");
  command.add_option("--robot", a.frames.robot, "Robot description instead of the log's own");
  command.add_option("--voxel", a.texture.volume.voxel, "Edge of the surface's pieces, m")
      ->check(CLI::Range(0.005, 0.2))
      ->capture_default_str();
  command.add_option("--images", a.frames.max_images, "At most this many images of a kind")
      ->check(CLI::Range(1, 5000))
      ->capture_default_str();
  command.add_option("--threads", a.texture.threads, "Threads; 0: all; the bytes are the same")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command.add_flag("--force", a.overwrite, "Overwrite an existing texture");
}

}  // namespace

void add_map_texture(CLI::App& map, Exit& exit) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = map.add_subcommand("texture", kDescription);
  command->footer(kFooter);
  add_options(*command, *arguments);
  run_where_given(*command, arguments, exit, run);
}

}  // namespace parhelion::tools
