// What a virtual camera would have seen where images of a recording were held back.
//   texture_quality LOG [MODEL [FOLDER [COUNT [FIRST STEP]]]]
// FOLDER receives pictures: recorded and drawn, the error times three and what the recording has seen. The
// images are COUNT from the first to the last, or FIRST, FIRST + STEP and so on.
// For each of COUNT images, those go into the texture that were taken at least 0.3 m or 15 degrees from it.
// Each is compared three times: as it was recorded; without the lens's error that the others have shown; and
// the same, drawn from where its own depth image fits the surface, as its recorded pose may be wrong.
#include <array>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "fusion/semantic/texture/build_texture.hpp"
#include "render/jpeg.hpp"
#include "render/textured_camera.hpp"
#include "tests/bench/place_by_depth.hpp"
#include "tests/picture_quality.hpp"
#include "tools/map/image_frames.hpp"

namespace {

using namespace parhelion;
using Clock = std::chrono::steady_clock;

constexpr double kDistance = 0.3, kAngle = 15 * std::numbers::pi / 180;
constexpr int kPictures = 20;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

template <class T>
T must(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

bool is_far(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const Eigen::Isometry3d between = a.inverse(Eigen::Isometry) * b;
  return between.translation().norm() >= kDistance || Eigen::AngleAxisd(between.linear()).angle() >= kAngle;
}

/// Whether a depth image that went in measured the point: 3 cm and 3 % of the distance.
bool was_measured(const Eigen::Vector3d& p_map, const std::vector<semantic::DepthView>& views) {
  for (const semantic::DepthView& view : views) {
    const Eigen::Vector3d p = view.T_map_optical.inverse() * p_map;
    if (p.z() < 0.1) continue;
    const Eigen::Vector2d pixel = view.camera.project(p);
    if (!view.camera.contains(pixel)) continue;
    const double depth = view.millimetres[view.camera.at(static_cast<int>(pixel.x() + 0.5),
                                                         static_cast<int>(pixel.y() + 0.5))] *
                         1e-3;
    if (depth > 0 && std::abs(depth - p.z()) < 0.03 + 0.03 * p.z()) return true;
  }
  return false;
}

/// The pixels of the held-back image that its own depth image places where one that went in measured.
cv::Mat seen_pixels(const semantic::ColourView& held, const semantic::DepthView& depth,
                    const std::vector<semantic::DepthView>& views) {
  cv::Mat seen(held.camera.height, held.camera.width, CV_8U, cv::Scalar(0));
  const Transform<CameraOptical, Map> T_optical_map = held.T_map_optical.inverse();
  for (int row = 0; row < depth.camera.height; ++row) {
    for (int column = 0; column < depth.camera.width; ++column) {
      const double z = depth.millimetres[depth.camera.at(column, row)] * 1e-3;
      if (z <= 0) continue;
      const Eigen::Vector3d p_map =
          depth.T_map_optical * Eigen::Vector3d((column - depth.camera.cx) / depth.camera.fx * z,
                                                (row - depth.camera.cy) / depth.camera.fy * z, z);
      const Eigen::Vector3d p = T_optical_map * p_map;
      if (p.z() < 0.1 || !was_measured(p_map, views)) continue;
      const Eigen::Vector2d pixel = held.camera.project(p);
      if (held.camera.contains(pixel, 1))
        cv::rectangle(seen, cv::Rect(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()), 2, 2), 255,
                      cv::FILLED);
    }
  }
  cv::medianBlur(seen, seen, 5);
  return seen;
}

cv::Mat bgr_of(const semantic::ColourView& view) {
  cv::Mat picture(view.camera.height, view.camera.width, CV_8UC3);
  for (std::size_t i = 0; i < view.rgb.size(); ++i) picture.data[i] = view.rgb[i / 3 * 3 + 2 - i % 3];
  return picture;
}

CameraDescription describe(const semantic::Pinhole& c) {
  CameraDescription camera;
  camera.intrinsics.width = c.width, camera.intrinsics.height = c.height;
  camera.intrinsics.fx = c.fx, camera.intrinsics.fy = c.fy;
  camera.intrinsics.cx = c.cx, camera.intrinsics.cy = c.cy;
  return camera;
}

/// A held-back image as it is compared.
struct HeldBack {
  const char* name;
  semantic::ColourView colour;
  semantic::DepthView depth;
};
constexpr std::size_t kComparisons = 3;

/// As it was recorded; without the error of the lens; and placed by its own depth image, too.
std::array<HeldBack, kComparisons> comparisons_of(const semantic::ColourView& colour,
                                                  const semantic::DepthView& depth,
                                                  const semantic::BuiltTexture& built) {
  const semantic::ColourView mended = semantic::corrected(colour, built.lens);
  const semantic::QuadSurface surface{built.texture.vertices,
                                      {built.texture.quads.begin(), built.texture.quads.end()}};
  HeldBack placed{"placed", mended, depth};
  placed.depth.T_map_optical = bench::place_by_depth(depth, surface);
  placed.colour.T_map_optical =
      placed.depth.T_map_optical * (depth.T_map_optical.inverse() * colour.T_map_optical);
  return {HeldBack{"recorded", colour, depth}, HeldBack{"lens", mended, depth}, placed};
}

struct Likeness {
  double psnr = 0, ssim = 0, seen = 0;
};

struct Figures {
  std::array<Likeness, kComparisons> likeness;
  double cpu = 0, rate = 0;  ///< s of CPU a picture, of all threads; pictures/s
};

class Quality {
 public:
  Quality(std::string log, const SemanticModel& model, std::string folder)
      : log_(std::move(log)), model_(model), folder_(std::move(folder)) {
    tools::ImageFrameOptions everything;
    everything.distance = everything.angle = 0;
    everything.max_images = 1'000'000;
    all_ = must(tools::read_image_frames(log_, everything));
  }

  std::size_t images() const { return std::min(all_.colour.size(), all_.depth.size()); }

  Figures measure(std::size_t index) {
    const semantic::ColourView& held = all_.colour.at(index);
    const semantic::DepthView& depth = all_.depth.at(index);
    const Eigen::Isometry3d& place = held.T_map_optical.isometry();
    tools::ImageFrameOptions far;
    far.wanted = [&](const Eigen::Isometry3d& T) { return is_far(place, T); };
    const tools::ImageFrames frames = must(tools::read_image_frames(log_, far));
    const auto start = Clock::now();
    semantic::BuiltTexture built = must(semantic::build_texture(model_, frames.colour, frames.depth));
    std::printf("image %3zu: %zu images, %zu depth images, %zu pieces, built in %.1f s", index,
                frames.colour.size(), frames.depth.size(), built.texture.quads.size(), seconds_since(start));
    const auto camera = camera_of(built);
    Figures figures;
    const auto compared = comparisons_of(held, depth, built);
    for (std::size_t i = 0; i < kComparisons; ++i) {
      const cv::Mat drawn = draw(*camera, compared[i].colour, figures);
      const cv::Mat real = bgr_of(compared[i].colour);
      const cv::Mat seen = seen_pixels(compared[i].colour, compared[i].depth, frames.depth);
      figures.likeness[i] = {test::psnr(real, drawn, seen), test::ssim(real, drawn, seen),
                             cv::mean(seen)[0] / 255};
      print(compared[i].name, figures.likeness[i]);
      write(index, compared[i].name, real, drawn, seen);
    }
    const Eigen::Isometry3d moved =
        (compared[1].depth.T_map_optical.inverse() * compared[2].depth.T_map_optical).isometry();
    std::printf(" | moved %.1f cm, %.1f degrees | %.1f pictures/s, %.1f ms of CPU each\n",
                100 * moved.translation().norm(),
                Eigen::AngleAxisd(moved.linear()).angle() * 180 / std::numbers::pi, figures.rate,
                1000 * figures.cpu);
    std::fflush(stdout);
    return figures;
  }

  static void print(const char* name, const Likeness& likeness) {
    std::printf(" | %s: %.2f dB, SSIM %.3f, seen %.2f", name, likeness.psnr, likeness.ssim, likeness.seen);
  }

 private:
  std::unique_ptr<render::VirtualCamera> camera_of(semantic::BuiltTexture& built) const {
    std::vector<std::uint8_t> bgr = built.rgb;
    for (std::size_t i = 0; i + 2 < bgr.size(); i += 3) std::swap(bgr[i], bgr[i + 2]);
    render::JpegCodec codec;
    built.texture.jpeg =
        must(codec.encode(bgr, {built.width, built.height, 92, render::JpegFormat::Subsampling::yuv444}));
    return must(render::create_virtual_camera(model_, &built.texture));
  }

  static cv::Mat draw(render::VirtualCamera& camera, const semantic::ColourView& held, Figures& figures) {
    Image image;
    (void)camera.render(describe(held.camera), held.T_map_optical, {}, {}, "");
    const std::clock_t busy = std::clock();
    const auto start = Clock::now();
    for (int i = 0; i < kPictures; ++i)
      image = camera.render(describe(held.camera), held.T_map_optical, {}, {}, "");
    figures.rate = kPictures / seconds_since(start);
    figures.cpu = static_cast<double>(std::clock() - busy) / CLOCKS_PER_SEC / kPictures;
    return cv::imdecode(image.bytes, cv::IMREAD_COLOR);
  }

  void write(std::size_t index, const char* name, const cv::Mat& real, const cv::Mat& drawn,
             const cv::Mat& seen) const {
    if (folder_.empty()) return;
    cv::Mat error, mask, above, below, all;
    cv::absdiff(real, drawn, error);
    cv::cvtColor(seen, mask, cv::COLOR_GRAY2BGR);
    cv::hconcat(real, drawn, above);
    cv::hconcat(cv::Mat(error * 3), mask, below);
    cv::vconcat(above, below, all);
    char file[64];
    std::snprintf(file, sizeof file, "held_back_%04zu_%s.png", index, name);
    cv::imwrite((std::filesystem::path(folder_) / file).string(), all);
  }

  std::string log_;
  const SemanticModel& model_;
  std::string folder_;
  tools::ImageFrames all_;
};

std::vector<std::size_t> wanted_images(int count, char** words, std::size_t images) {
  const auto wanted = static_cast<std::size_t>(count > 4 ? std::stoi(words[4]) : 9);
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < wanted; ++i)
    indices.push_back(count > 6 ? std::stoul(words[5]) + i * std::stoul(words[6])
                                : i * (images - 1) / std::max<std::size_t>(1, wanted - 1));
  return indices;
}

int run(int count, char** words) {
  if (count < 2) throw std::runtime_error("usage: texture_quality LOG [MODEL [FOLDER [COUNT [FIRST STEP]]]]");
  const SemanticModel model = count > 2 && *words[2] != '\0' ? must(load_model(words[2])) : SemanticModel{};
  Quality quality(words[1], model, count > 3 ? words[3] : "");
  const std::vector<std::size_t> images = wanted_images(count, words, quality.images());
  const auto n = static_cast<double>(images.size());
  Figures mean, worst;
  worst.likeness.fill({1e9, 1e9, 1e9});
  for (const std::size_t index : images) {
    const Figures figures = quality.measure(index);
    for (std::size_t i = 0; i < kComparisons; ++i) {
      const Likeness& now = figures.likeness[i];
      Likeness& sum = mean.likeness[i];
      Likeness& low = worst.likeness[i];
      sum.psnr += now.psnr / n, sum.ssim += now.ssim / n, sum.seen += now.seen / n;
      low.psnr = std::min(low.psnr, now.psnr), low.ssim = std::min(low.ssim, now.ssim);
      low.seen = std::min(low.seen, now.seen);
    }
    mean.rate += figures.rate / n, mean.cpu += figures.cpu / n;
  }
  constexpr const char* kNames[kComparisons] = {"recorded", "lens", "placed"};
  std::printf("mean: %.1f pictures/s, %.1f ms of CPU each", mean.rate, 1000 * mean.cpu);
  for (std::size_t i = 0; i < kComparisons; ++i) Quality::print(kNames[i], mean.likeness[i]);
  std::printf("\nworst");
  for (std::size_t i = 0; i < kComparisons; ++i) Quality::print(kNames[i], worst.likeness[i]);
  std::printf("\n");
  return 0;
}

}  // namespace

int main(int count, char** words) {
  try {
    return run(count, words);
  } catch (const std::exception& fault) {
    std::fprintf(stderr, "texture_quality: %s\n", fault.what());
    return 1;
  }
}
