#include "render/depth_occlusion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

namespace parhelion::render {
namespace {

using Rule = DepthRule;

/// exp(-d / (2 sigma^2)) of a squared colour difference, in steps of 8.
const std::array<float, 4096>& colour_weights() {
  static const std::array<float, 4096> table = [] {
    std::array<float, 4096> t{};
    for (std::size_t i = 0; i < t.size(); ++i)
      t[i] = static_cast<float>(
          std::exp(-(8.0 * static_cast<double>(i) + 3.5) / (2 * Rule::kColourSigma * Rule::kColourSigma)));
    return t;
  }();
  return table;
}

struct Tap {
  int dx, dy;
  float weight;
};

const std::vector<Tap>& taps() {
  static const std::vector<Tap> list = [] {
    std::vector<Tap> t;
    for (int dy = -Rule::kRadius; dy <= Rule::kRadius; dy += 2)
      for (int dx = -Rule::kRadius; dx <= Rule::kRadius; dx += 2)
        t.push_back({dx, dy,
                     static_cast<float>(
                         std::exp(-(dx * dx + dy * dy) / (2 * Rule::kSpatialSigma * Rule::kSpatialSigma)))});
    return t;
  }();
  return list;
}

const std::vector<Tap>& asked_taps() {
  static const std::vector<Tap> list = [] {
    std::vector<Tap> t;
    for (const int step : Rule::kAskedSteps)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
          if (dx || dy)
            t.push_back({dx * step, dy * step,
                         static_cast<float>(Rule::kAsked * std::exp(-step / Rule::kAskedRange))});
    return t;
  }();
  return list;
}

/// The part of the depth image that can fall on `window` of the image, from any range.
PixelRect depth_part(const DepthView& view, const PixelRect& window,
                     const Transform<DepthOptical, CameraOptical>& T_depth_optical, double z_far) {
  const PixelRect whole{0, 0, view.depth.width, view.depth.height};
  PixelRect part;
  const auto add = [&](int x, int y) {
    const Eigen::Vector3d ray = view.camera.direction(x, y);
    for (const double range : {0.25, z_far}) {
      const auto pixel = view.depth_camera.lens().project(T_depth_optical * Eigen::Vector3d(ray * range));
      if (!pixel) return false;
      const auto u = static_cast<int>(std::clamp(pixel->x(), -9.0, 9000.0)),
                 v = static_cast<int>(std::clamp(pixel->y(), -9.0, 9000.0));
      part = part.united({u - 4, v - 4, u + 5, v + 5});
    }
    return true;
  };
  bool bounded = true;
  for (int x = window.x0; x < window.x1 && bounded; x += 8)
    bounded = add(x, window.y0) && add(x, window.y1 - 1);
  for (int y = window.y0; y < window.y1 && bounded; y += 8)
    bounded = add(window.x0, y) && add(window.x1 - 1, y);
  bounded = bounded && add(window.x1 - 1, window.y1 - 1);
  return bounded ? part.intersected(whole) : whole;
}

/// Floor and ceiling of pixel coordinates (above -4096): libm's are function calls on a portable baseline.
int floor_pixel(double x) { return static_cast<int>(x + 4096) - 4096; }
int ceil_pixel(double x) { return 4096 - static_cast<int>(4096 - x); }

double smoothstep(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// Depth along the optical axis of the intersection of a pixel's ray with the floor; kNothing without one.
double floor_depth(const DepthView& view, int x, int y) {
  const Eigen::Vector3d ray = view.camera.direction(x, y);
  const double fall = (view.T_map_optical.rotation() * ray).z();
  const double height = view.T_map_optical.translation().z() - view.floor_z;
  return fall < -1e-6 && height > 0 ? ray.z() * height / -fall : Rule::kNothing;
}

/// The pixel of a point (camera_optical, m) in front of the camera; nullopt: the lens does not show it.
std::optional<Eigen::Vector2d> pixel_of(const CameraProjection& camera, const Eigen::Vector3d& p) {
  if (!camera.direct()) return camera.lens().project(p);
  const CameraIntrinsics& c = camera.intrinsics();
  const double inverse = 1 / p.z();
  return Eigen::Vector2d(c.fx * p.x() * inverse + c.cx, c.fy * p.y() * inverse + c.cy);
}

}  // namespace

void DepthOcclusion::put_depth(const Eigen::Vector2d& pixel, double half, double z) {
  if (!(pixel.x() > window_.x0 - 5 && pixel.x() < window_.x1 + 5 && pixel.y() > window_.y0 - 5 &&
        pixel.y() < window_.y1 + 5))
    return;
  const int x0 = std::max(window_.x0, ceil_pixel(pixel.x() - half));
  const int x1 = std::min(window_.x1 - 1, floor_pixel(pixel.x() + half));
  const int y0 = std::max(window_.y0, ceil_pixel(pixel.y() - half));
  const int y1 = std::min(window_.y1 - 1, floor_pixel(pixel.y() + half));
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      float& nearest = depth_[at(x, y)];
      nearest = std::min(nearest, static_cast<float>(z));
    }
  }
}

void DepthOcclusion::register_depth(const DepthView& view) {
  const std::size_t count =
      static_cast<std::size_t>(window_.width()) * static_cast<std::size_t>(window_.height());
  depth_.assign(count, static_cast<float>(Rule::kNothing));
  confidence_.assign(count, 0.F);
  const Transform<CameraOptical, DepthOptical> T_optical_depth =
      view.T_map_optical.inverse() * view.T_map_depth;
  const Eigen::Matrix3d R = T_optical_depth.rotation();
  const Eigen::Vector3d t = T_optical_depth.translation();
  const CameraIntrinsics& d = view.depth_camera.intrinsics();
  const CameraIntrinsics& c = view.camera.intrinsics();
  const double z_min = std::max(view.description.range_min, 0.001);
  const double z_max = view.description.range_max > 0 ? view.description.range_max : 65.534;
  const PixelRect part = depth_part(view, window_, T_optical_depth.inverse(), z_max);
  const double scale = 0.5 * std::max(c.fx / d.fx, c.fy / d.fy);
  const Eigen::Vector3d column = R.col(0) / d.fx;
  for (int v = part.y0; v < part.y1; ++v) {
    const Eigen::Vector3d row = R * Eigen::Vector3d(-d.cx / d.fx, (v - d.cy) / d.fy, 1);
    for (int u = part.x0; u < part.x1; ++u) {
      const double z =
          0.001 *
          view.depth.millimetres[static_cast<std::size_t>(v) * static_cast<std::size_t>(view.depth.width) +
                                 static_cast<std::size_t>(u)];
      if (z < z_min || z > z_max) continue;
      Eigen::Vector3d p;
      if (view.depth_camera.direct()) {
        p = z * (row + u * column) + t;
      } else {
        const Eigen::Vector3d ray = view.depth_camera.direction(u, v);
        if (ray.z() < 0.05) continue;
        p = R * (z / ray.z() * ray) + t;
      }
      if (p.z() < kNearPlane) continue;
      const auto pixel = pixel_of(view.camera, p);
      if (pixel) put_depth(*pixel, std::min(4.0, std::max(0.5, scale * z / p.z()) + 0.05), p.z());
    }
  }
  for (std::size_t i = 0; i < count; ++i)
    if (depth_[i] < static_cast<float>(Rule::kNothing)) confidence_[i] = static_cast<float>(Rule::kMeasured);
}

/// Measured depths close to a jump get a low weight.
void DepthOcclusion::find_edges() {
  const cv::Mat depth(window_.height(), window_.width(), CV_32F, depth_.data());
  nearest_.resize(depth_.size());
  farthest_.resize(depth_.size());
  cv::Mat nearest(depth.size(), CV_32F, nearest_.data()), farthest(depth.size(), CV_32F, farthest_.data());
  cv::Mat known;
  depth.copyTo(known);
  known.setTo(0, depth >= Rule::kNothing);
  const int side = 2 * Rule::kEdgeRadius + 1;
  const cv::Mat square = cv::Mat::ones(side, side, CV_8U);
  cv::erode(depth, nearest, square);
  cv::dilate(known, farthest, square);
  for (std::size_t i = 0; i < depth_.size(); ++i) {
    if (confidence_[i] != static_cast<float>(Rule::kMeasured)) continue;
    if (farthest_[i] - nearest_[i] <= static_cast<float>(Rule::jump(static_cast<double>(depth_[i]))))
      continue;
    const bool near_side = depth_[i] < 0.5F * (farthest_[i] + nearest_[i]);
    confidence_[i] = static_cast<float>(near_side ? Rule::kNearEdge : Rule::kFarEdge);
  }
}

void DepthOcclusion::add_model(const Layer& modelled) {
  const PixelRect rect = modelled.rect.intersected(window_);
  for (int y = rect.y0; y < rect.y1; ++y) {
    for (int x = rect.x0; x < rect.x1; ++x) {
      const std::uint32_t depth_id = modelled.depth_id[modelled.at(x, y)];
      float& depth = depth_[at(x, y)];
      if (!depth_id || depth < static_cast<float>(Rule::kNothing)) continue;
      depth = static_cast<float>(layer_depth(depth_id));
      confidence_[at(x, y)] = static_cast<float>(Rule::kModelled);
    }
  }
}

/// Nearest and farthest known depth around each pixel, for early decisions.
void DepthOcclusion::find_bounds() {
  const cv::Mat depth(window_.height(), window_.width(), CV_32F, depth_.data());
  cv::Mat nearest(depth.size(), CV_32F, nearest_.data()), farthest(depth.size(), CV_32F, farthest_.data());
  const int side = 2 * Rule::kRadius + 1;
  const cv::Mat square = cv::Mat::ones(side, side, CV_8U);
  cv::erode(depth, nearest, square);
  cv::Mat known;
  depth.copyTo(known);
  known.setTo(0, depth >= Rule::kNothing);
  cv::dilate(known, farthest, square);
}

double DepthOcclusion::visible_fraction(const DepthView& view, int x, int y, float threshold) const {
  const auto width = static_cast<std::ptrdiff_t>(view.camera.intrinsics().width);
  const auto stride = static_cast<std::ptrdiff_t>(window_.width());
  const std::uint8_t* centre = &view.bgr[3 * static_cast<std::size_t>(y * width + x)];
  const std::size_t here = at(x, y);
  const auto& colours = colour_weights();
  float behind = 0, all = 0;
  const auto add = [&](const std::vector<Tap>& list, int reach) {
    const bool inside = x - reach >= window_.x0 && y - reach >= window_.y0 && x + reach < window_.x1 &&
                        y + reach < window_.y1;
    for (const Tap& tap : list) {
      const int qx = x + tap.dx, qy = y + tap.dy;
      if (!inside && (qx < window_.x0 || qy < window_.y0 || qx >= window_.x1 || qy >= window_.y1)) continue;
      const std::size_t i = here + static_cast<std::size_t>(tap.dy * stride + tap.dx);
      const float confidence = confidence_[i];
      if (confidence == 0) continue;
      const std::uint8_t* q = centre + 3 * (tap.dy * width + tap.dx);
      const int b = q[0] - centre[0], g = q[1] - centre[1], r = q[2] - centre[2];
      const auto step = static_cast<unsigned>(b * b + g * g + r * r) / 8;
      const float likeness = step < colours.size() ? colours[step] : 0;
      const float weight = tap.weight * confidence * (likeness + static_cast<float>(Rule::kUnlike));
      all += weight;
      behind += depth_[i] >= threshold ? weight : 0;
    }
  };
  add(taps(), Rule::kRadius);
  if (confidence_[here] < static_cast<float>(Rule::kMeasured)) add(asked_taps(), Rule::kReach);
  return all > 0 ? static_cast<double>(behind / all) : 1;
}

void DepthOcclusion::apply(const DepthView& view, Layer& layer) {
  const CameraIntrinsics& c = view.camera.intrinsics();
  window_ = layer.rect.grown(Rule::kReach).intersected({0, 0, c.width, c.height});
  register_depth(view);
  find_edges();
  add_model(view.modelled);
  find_bounds();
  const PixelRect& rect = layer.rect;
  for (int y = rect.y0; y < rect.y1; ++y) {
    for (int x = rect.x0; x < rect.x1; ++x) {
      const std::size_t i = layer.at(x, y);
      std::uint8_t* rgba = &layer.rgba[4 * i];
      if (!rgba[3]) continue;
      std::uint32_t depth_id = layer.depth_id[i];
      if (!depth_id && (rgba[0] | rgba[1] | rgba[2])) {  // an edge whose own sample missed the body
        for (const auto& [dx, dy] :
             {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}, {-1, -1}, {1, -1}, {-1, 1}, {1, 1}}) {
          const int nx = x + dx, ny = y + dy;
          if (nx < rect.x0 || ny < rect.y0 || nx >= rect.x1 || ny >= rect.y1) continue;
          depth_id = layer.depth_id[layer.at(nx, ny)];
          if (depth_id) break;
        }
      }
      const double z = depth_id ? layer_depth(depth_id) : floor_depth(view, x, y);
      const auto threshold = static_cast<float>(z - Rule::tolerance(std::min(z, 20.0)));
      const std::size_t w = at(x, y);
      const bool known = confidence_[w] > 0;
      if (known && nearest_[w] >= threshold) continue;
      const double fraction = known && farthest_[w] < threshold ? 0 : visible_fraction(view, x, y, threshold);
      const double coverage = smoothstep(Rule::kSoftLow, Rule::kSoftHigh, fraction);
      for (int k = 0; k < 4; ++k) rgba[k] = static_cast<std::uint8_t>(rgba[k] * coverage + 0.5);
      if (!rgba[3]) rgba[0] = rgba[1] = rgba[2] = 0, layer.depth_id[i] = 0;
    }
  }
}

}  // namespace parhelion::render
