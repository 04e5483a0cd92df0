// What a virtual camera would have seen where images of a recording were held back.
//   texture_quality LOG [MODEL [FOLDER [COUNT]]]   FOLDER receives pictures: recorded and drawn, the error
//                                                  times three and what the recording has seen
// For each of COUNT images, those go into the texture that were taken at least 0.3 m or 15 degrees from it.
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
#include "tests/picture_quality.hpp"
#include "tools/image_frames.hpp"

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

struct Figures {
  double psnr = 0, ssim = 0, seen = 0, built = 0;
  double rate = 0, cpu = 0;  ///< pictures/s; s of CPU a picture, of all threads
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
    const semantic::ColourView& held = all_.colour[index];
    const Eigen::Isometry3d& place = held.T_map_optical.isometry();
    tools::ImageFrameOptions far;
    far.wanted = [&](const Eigen::Isometry3d& T) { return is_far(place, T); };
    const tools::ImageFrames frames = must(tools::read_image_frames(log_, far));
    Figures figures;
    const auto start = Clock::now();
    semantic::BuiltTexture built = must(semantic::build_texture(model_, frames.colour, frames.depth));
    figures.built = seconds_since(start);
    const cv::Mat drawn = draw(built, held, figures);
    const cv::Mat real = bgr_of(held);
    const cv::Mat seen = seen_pixels(held, all_.depth[index], frames.depth);
    figures.seen = cv::mean(seen)[0] / 255;
    figures.psnr = test::psnr(real, drawn, seen);
    figures.ssim = test::ssim(real, drawn, seen);
    write(index, real, drawn, seen);
    std::printf(
        "image %3zu: %zu images, %zu depth images, %zu pieces | seen %.2f of the picture, PSNR %.2f dB, "
        "SSIM %.3f | %.1f pictures/s, %.1f ms of CPU each, built in %.1f s\n",
        index, frames.colour.size(), frames.depth.size(), built.texture.quads.size(), figures.seen,
        figures.psnr, figures.ssim, figures.rate, 1000 * figures.cpu, figures.built);
    std::fflush(stdout);
    return figures;
  }

 private:
  cv::Mat draw(semantic::BuiltTexture& built, const semantic::ColourView& held, Figures& figures) const {
    std::vector<std::uint8_t> bgr = built.rgb;
    for (std::size_t i = 0; i + 2 < bgr.size(); i += 3) std::swap(bgr[i], bgr[i + 2]);
    render::JpegCodec codec;
    built.texture.jpeg =
        must(codec.encode(bgr, {built.width, built.height, 92, render::JpegFormat::Subsampling::yuv444}));
    const auto camera = must(render::create_virtual_camera(model_, &built.texture));
    Image image;
    (void)camera->render(describe(held.camera), held.T_map_optical, {}, {}, "");
    const std::clock_t busy = std::clock();
    const auto start = Clock::now();
    for (int i = 0; i < kPictures; ++i)
      image = camera->render(describe(held.camera), held.T_map_optical, {}, {}, "");
    figures.rate = kPictures / seconds_since(start);
    figures.cpu = static_cast<double>(std::clock() - busy) / CLOCKS_PER_SEC / kPictures;
    return cv::imdecode(image.bytes, cv::IMREAD_COLOR);
  }

  void write(std::size_t index, const cv::Mat& real, const cv::Mat& drawn, const cv::Mat& seen) const {
    if (folder_.empty()) return;
    cv::Mat error, mask, above, below, all;
    cv::absdiff(real, drawn, error);
    cv::cvtColor(seen, mask, cv::COLOR_GRAY2BGR);
    cv::hconcat(real, drawn, above);
    cv::hconcat(cv::Mat(error * 3), mask, below);
    cv::vconcat(above, below, all);
    char name[48];
    std::snprintf(name, sizeof name, "held_back_%04zu.png", index);
    cv::imwrite((std::filesystem::path(folder_) / name).string(), all);
  }

  std::string log_;
  const SemanticModel& model_;
  std::string folder_;
  tools::ImageFrames all_;
};

int run(int count, char** words) {
  if (count < 2) throw std::runtime_error("usage: texture_quality LOG [MODEL [FOLDER [COUNT]]]");
  const SemanticModel model = count > 2 && *words[2] != '\0' ? must(load_model(words[2])) : SemanticModel{};
  Quality quality(words[1], model, count > 3 ? words[3] : "");
  const auto wanted = static_cast<std::size_t>(count > 4 ? std::stoi(words[4]) : 9);
  Figures sum, worst{1e9, 1e9};
  for (std::size_t i = 0; i < wanted; ++i) {
    const Figures figures =
        quality.measure(i * (quality.images() - 1) / std::max<std::size_t>(1, wanted - 1));
    sum.psnr += figures.psnr, sum.ssim += figures.ssim, sum.rate += figures.rate, sum.cpu += figures.cpu;
    worst.psnr = std::min(worst.psnr, figures.psnr), worst.ssim = std::min(worst.ssim, figures.ssim);
  }
  const auto n = static_cast<double>(wanted);
  std::printf(
      "mean: PSNR %.2f dB, SSIM %.3f, %.1f pictures/s, %.1f ms of CPU each; worst: PSNR %.2f dB, SSIM %.3f\n",
      sum.psnr / n, sum.ssim / n, sum.rate / n, 1000 * sum.cpu / n, worst.psnr, worst.ssim);
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
