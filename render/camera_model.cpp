#include "render/camera_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "protocols/angle_units.hpp"
#include "render/image_limits.hpp"

namespace parhelion::render {
namespace {

constexpr double kMaxTheta = 3.1;  ///< rad, a fisheye's widest half angle

bool has_no_distortion(const CameraIntrinsics& c) {
  return c.lens == CameraIntrinsics::Lens::radial_tangential &&
         std::all_of(c.distortion.begin(), c.distortion.end(), [](double d) { return d == 0; });
}

/// Brown (1966), OpenCV's order k1 k2 p1 p2 k3.
Eigen::Vector2d distort_brown(const std::array<double, 5>& d, double x, double y) {
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
  return {x * radial + 2 * d[2] * x * y + d[3] * (r2 + 2 * x * x),
          y * radial + d[2] * (r2 + 2 * y * y) + 2 * d[3] * x * y};
}

/// Derivative of r * radial(r^2): where it becomes negative the polynomial folds back and is invalid.
double radial_slope(const std::array<double, 5>& d, double r2) {
  return 1 + r2 * (3 * d[0] + r2 * (5 * d[1] + r2 * 7 * d[4]));
}

/// Smallest r at which the radial polynomial stops growing.
double monotonic_radius(const std::array<double, 5>& d) {
  for (double r = 0.01; r < 20; r += 0.01)
    if (radial_slope(d, r * r) <= 0) return r - 0.01;
  return 20;
}

/// Kannala and Brandt (2006), equation 6, without the asymmetric terms.
double distort_theta(const std::array<double, 5>& k, double theta) {
  const double t2 = theta * theta;
  return theta * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
}

double theta_slope(const std::array<double, 5>& k, double theta) {
  const double t2 = theta * theta;
  return 1 + t2 * (3 * k[0] + t2 * (5 * k[1] + t2 * (7 * k[2] + t2 * 9 * k[3])));
}

double monotonic_theta(const std::array<double, 5>& k) {
  for (double theta = 0.01; theta < kMaxTheta; theta += 0.01)
    if (theta_slope(k, theta) <= 0) return theta - 0.01;
  return kMaxTheta;
}

std::optional<Eigen::Vector3d> undistort_brown(const std::array<double, 5>& d, double xd, double yd,
                                               double radius) {
  double x = xd, y = yd;
  if (const double r = std::hypot(x, y); r > radius) x *= radius / r, y *= radius / r;
  for (int i = 0; i < 40; ++i) {  // Newton on the residual, with the analytic Jacobian
    const double r2 = x * x + y * y;
    const Eigen::Vector2d residual = distort_brown(d, x, y) - Eigen::Vector2d(xd, yd);
    const double radial = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
    const double slope = 2 * (d[0] + r2 * (2 * d[1] + r2 * 3 * d[4]));  // d radial / d r2 * 2
    const double a = radial + slope * x * x + 2 * d[2] * y + 6 * d[3] * x;
    const double b = slope * x * y + 2 * d[2] * x + 2 * d[3] * y;
    const double c = radial + slope * y * y + 6 * d[2] * y + 2 * d[3] * x;
    const double determinant = a * c - b * b;
    if (std::abs(determinant) < 1e-12) return std::nullopt;
    const double dx = (c * residual.x() - b * residual.y()) / determinant;
    const double dy = (a * residual.y() - b * residual.x()) / determinant;
    x -= dx;
    y -= dy;
    if (dx * dx + dy * dy < 1e-24) break;
  }
  const Eigen::Vector2d residual = distort_brown(d, x, y) - Eigen::Vector2d(xd, yd);
  if (!(residual.norm() < 1e-9) || std::hypot(x, y) > radius) return std::nullopt;
  return Eigen::Vector3d(x, y, 1).normalized();
}

std::optional<Eigen::Vector3d> undistort_fisheye(const std::array<double, 5>& k, double xd, double yd,
                                                 double max_theta) {
  const double r = std::hypot(xd, yd);
  if (r > distort_theta(k, max_theta)) return std::nullopt;
  double low = 0, high = max_theta, theta = std::min(r, max_theta);
  for (int i = 0; i < 60; ++i) {  // Newton kept inside a shrinking bracket: always converges
    const double error = distort_theta(k, theta) - r;
    (error > 0 ? high : low) = theta;
    double next = theta - error / theta_slope(k, theta);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::abs(next - theta) < 1e-15) break;
    theta = next;
  }
  const double s = r > 0 ? std::sin(theta) / r : 0;
  return Eigen::Vector3d(xd * s, yd * s, std::cos(theta));
}

/// Rotations of the cube's faces, forward first; columns are the face's x, y, z in the optical frame.
std::vector<Eigen::Matrix3d> cube_faces() {
  std::vector<Eigen::Matrix3d> faces(6);
  faces[0] = Eigen::Matrix3d::Identity();
  faces[1] << 0, 0, 1, 0, 1, 0, -1, 0, 0;   // looks right
  faces[2] << 0, 0, -1, 0, 1, 0, 1, 0, 0;   // left
  faces[3] << 1, 0, 0, 0, 0, 1, 0, -1, 0;   // down
  faces[4] << 1, 0, 0, 0, 0, -1, 0, 1, 0;   // up
  faces[5] << -1, 0, 0, 0, 1, 0, 0, 0, -1;  // back
  return faces;
}

}  // namespace

PixelRect PixelRect::united(const PixelRect& o) const {
  if (empty()) return o;
  if (o.empty()) return *this;
  return {std::min(x0, o.x0), std::min(y0, o.y0), std::max(x1, o.x1), std::max(y1, o.y1)};
}

PixelRect PixelRect::intersected(const PixelRect& o) const {
  return {std::max(x0, o.x0), std::max(y0, o.y0), std::min(x1, o.x1), std::min(y1, o.y1)};
}

Result<CameraIntrinsics> intrinsics_for_size(const CameraIntrinsics& intrinsics, int width, int height) {
  CameraIntrinsics c = intrinsics;
  const std::string size = std::to_string(width) + "x" + std::to_string(height);
  if (width <= 0 || height <= 0 || width > kMaxImageSide || height > kMaxImageSide)
    return Error{"image size " + size + ": expected 1 to " + std::to_string(kMaxImageSide) +
                 " pixels a side"};
  const bool finite =
      std::isfinite(c.fx) && std::isfinite(c.fy) && std::isfinite(c.cx) && std::isfinite(c.cy) &&
      std::all_of(c.distortion.begin(), c.distortion.end(), [](double d) { return std::isfinite(d); });
  if (!finite || c.fx <= 0 || c.fy <= 0)
    return Error{
        "the camera is not calibrated: fx and fy in the robot description must be positive and finite"};
  if (c.width <= 0 || c.height <= 0)
    return Error{"the camera is not calibrated: width and height in the robot description must be positive"};
  if (c.width == width && c.height == height) return c;
  const double sx = static_cast<double>(width) / c.width, sy = static_cast<double>(height) / c.height;
  if (std::abs(sx / sy - 1) > 0.005)
    return Error{"image size " + size + " has another aspect than the calibration's " +
                 std::to_string(c.width) + "x" + std::to_string(c.height) + ": calibrate for this size"};
  c.fx *= sx, c.fy *= sy;
  c.cx = (c.cx + 0.5) * sx - 0.5, c.cy = (c.cy + 0.5) * sy - 0.5;
  c.width = width, c.height = height;
  return c;
}

Lens::Lens(const CameraIntrinsics& intrinsics) : c_(intrinsics), undistorted_(has_no_distortion(intrinsics)) {
  if (c_.lens == CameraIntrinsics::Lens::fisheye)
    limit_ = monotonic_theta(c_.distortion);
  else
    limit_ = undistorted_ ? std::numeric_limits<double>::infinity() : monotonic_radius(c_.distortion);
}

std::optional<Eigen::Vector2d> Lens::project(const Eigen::Vector3d& p) const {
  if (c_.lens == CameraIntrinsics::Lens::fisheye) {
    const double r = std::hypot(p.x(), p.y());
    const double theta = std::atan2(r, p.z());
    if ((r == 0 && p.z() <= 0) || theta > limit_) return std::nullopt;
    const double s = r > 0 ? distort_theta(c_.distortion, theta) / r : 1 / p.z();
    return Eigen::Vector2d(c_.fx * p.x() * s + c_.cx, c_.fy * p.y() * s + c_.cy);
  }
  if (p.z() <= 0) return std::nullopt;
  const double x = p.x() / p.z(), y = p.y() / p.z();
  if (undistorted_) return Eigen::Vector2d(c_.fx * x + c_.cx, c_.fy * y + c_.cy);
  if (std::hypot(x, y) > limit_) return std::nullopt;
  const Eigen::Vector2d d = distort_brown(c_.distortion, x, y);
  return Eigen::Vector2d(c_.fx * d.x() + c_.cx, c_.fy * d.y() + c_.cy);
}

std::optional<Eigen::Vector3d> Lens::unproject(const Eigen::Vector2d& pixel) const {
  const double xd = (pixel.x() - c_.cx) / c_.fx, yd = (pixel.y() - c_.cy) / c_.fy;
  if (c_.lens == CameraIntrinsics::Lens::fisheye) return undistort_fisheye(c_.distortion, xd, yd, limit_);
  if (undistorted_) return Eigen::Vector3d(xd, yd, 1).normalized();
  return undistort_brown(c_.distortion, xd, yd, limit_);
}

CameraProjection::CameraProjection(const CameraIntrinsics& intrinsics)
    : intrinsics_(intrinsics), lens_(intrinsics), direct_(lens_.undistorted()) {
  if (direct_) {
    views_.push_back({Eigen::Matrix3d::Identity(), intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy,
                      intrinsics.width, intrinsics.height});
    return;
  }
  make_sources();
}

/// Chooses the views from the image's largest off-axis angle and its resolution.
void CameraProjection::make_views(double max_angle, double max_slope_x, double max_slope_y, double scale) {
  const double f = std::max(intrinsics_.fx, intrinsics_.fy) * scale;
  constexpr double kOneView = 65 * kRadiansPerDegree;
  if (max_angle <= kOneView) {
    const int width = std::min(kMaxImageSide, 2 * static_cast<int>(std::ceil(f * max_slope_x)) + 5);
    const int height = std::min(kMaxImageSide, 2 * static_cast<int>(std::ceil(f * max_slope_y)) + 5);
    views_.push_back(
        {Eigen::Matrix3d::Identity(), f, f, 0.5 * (width - 1), 0.5 * (height - 1), width, height});
    return;
  }
  const int side = std::min(4096, 2 * static_cast<int>(std::ceil(f)) + 5);
  const double face_f = std::min(f, 0.5 * (side - 5));
  for (const Eigen::Matrix3d& R : cube_faces())
    views_.push_back({R, face_f, face_f, 0.5 * (side - 1), 0.5 * (side - 1), side, side});
}

void CameraProjection::make_sources() {
  const int width = intrinsics_.width, height = intrinsics_.height;
  std::vector<Eigen::Vector3f> rays(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  double max_angle = 0, slope_x = 0, slope_y = 0, finest = 1;
  std::size_t i = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, ++i) {
      const auto ray = lens_.unproject({x, y});
      rays[i] = ray ? Eigen::Vector3f(ray->cast<float>()) : Eigen::Vector3f::Zero();
      if (!ray) continue;
      max_angle = std::max(max_angle, std::acos(std::min(1.0, ray->z())));
      if (ray->z() > 0.05) {
        slope_x = std::max(slope_x, std::abs(ray->x() / ray->z()));
        slope_y = std::max(slope_y, std::abs(ray->y() / ray->z()));
      }
      if (x > 0 && rays[i - 1].z() > 0.4F && ray->z() > 0.4) {  // pixels of the image per pixel of a view
        const double step = std::abs(ray->x() / ray->z() - rays[i - 1].x() / rays[i - 1].z());
        if (step > 1e-6) finest = std::max(finest, 1 / (step * std::max(intrinsics_.fx, intrinsics_.fy)));
      }
    }
  }
  make_views(max_angle, slope_x, slope_y, std::min(finest, 2.0));

  sources_.resize(rays.size());
  blocks_x_ = (width + 15) / 16, blocks_y_ = (height + 15) / 16;
  constexpr float kInf = std::numeric_limits<float>::infinity();
  blocks_.assign(views_.size() * static_cast<std::size_t>(blocks_x_ * blocks_y_),
                 Block{kInf, kInf, -kInf, -kInf});
  i = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, ++i) {
      Source& source = sources_[i];
      source = {0, 0, kNoView};
      if (rays[i].isZero()) continue;
      Eigen::Vector3f best = rays[i];
      std::size_t view = 0;
      if (views_.size() > 1) {
        float nearest = -1;
        for (std::size_t k = 0; k < views_.size(); ++k) {
          const float cosine = views_[k].R_optical_view.col(2).cast<float>().dot(rays[i]);
          if (cosine > nearest) nearest = cosine, view = k;
        }
        best = views_[view].R_optical_view.transpose().cast<float>() * rays[i];
      }
      const PinholeView& v = views_[view];
      source.u = static_cast<float>(v.fx) * best.x() / best.z() + static_cast<float>(v.cx);
      source.v = static_cast<float>(v.fy) * best.y() / best.z() + static_cast<float>(v.cy);
      if (source.u < 1 || source.v < 1 || source.u > static_cast<float>(v.width - 3) ||
          source.v > static_cast<float>(v.height - 3))
        continue;
      source.view = static_cast<std::uint8_t>(view);
      Block& b = blocks_[view * static_cast<std::size_t>(blocks_x_ * blocks_y_) +
                         static_cast<std::size_t>((y / 16) * blocks_x_ + x / 16)];
      b.u0 = std::min(b.u0, source.u), b.v0 = std::min(b.v0, source.v);
      b.u1 = std::max(b.u1, source.u), b.v1 = std::max(b.v1, source.v);
    }
  }
}

Eigen::Vector3d CameraProjection::direction(int x, int y) const {
  if (direct_)
    return Eigen::Vector3d((x - intrinsics_.cx) / intrinsics_.fx, (y - intrinsics_.cy) / intrinsics_.fy, 1)
        .normalized();
  const Source& s = source(x, y);
  if (s.view == kNoView) return Eigen::Vector3d::Zero();
  const PinholeView& v = views_[s.view];
  return (v.R_optical_view * Eigen::Vector3d((static_cast<double>(s.u) - v.cx) / v.fx,
                                             (static_cast<double>(s.v) - v.cy) / v.fy, 1))
      .normalized();
}

PixelRect CameraProjection::image_rect(std::size_t view, const PixelRect& rect) const {
  const PixelRect image{0, 0, intrinsics_.width, intrinsics_.height};
  if (direct_) return rect.intersected(image);
  PixelRect united;
  const std::size_t base = view * static_cast<std::size_t>(blocks_x_ * blocks_y_);
  for (int by = 0; by < blocks_y_; ++by) {
    for (int bx = 0; bx < blocks_x_; ++bx) {
      const Block& b = blocks_[base + static_cast<std::size_t>(by * blocks_x_ + bx)];
      const bool overlaps = b.u0 <= static_cast<float>(rect.x1) && b.u1 >= static_cast<float>(rect.x0 - 1) &&
                            b.v0 <= static_cast<float>(rect.y1) && b.v1 >= static_cast<float>(rect.y0 - 1);
      if (overlaps) united = united.united({16 * bx, 16 * by, 16 * bx + 16, 16 * by + 16});
    }
  }
  return united.intersected(image);
}

PixelRect CameraProjection::view_rect(std::size_t view, const PixelRect& image) const {
  const PinholeView& v = views_[view];
  if (direct_) return image.intersected({0, 0, v.width, v.height});
  PixelRect united;
  const std::size_t base = view * static_cast<std::size_t>(blocks_x_ * blocks_y_);
  for (int by = std::max(0, image.y0 / 16); by < blocks_y_ && by * 16 < image.y1; ++by) {
    for (int bx = std::max(0, image.x0 / 16); bx < blocks_x_ && bx * 16 < image.x1; ++bx) {
      const Block& b = blocks_[base + static_cast<std::size_t>(by * blocks_x_ + bx)];
      if (b.u0 > b.u1) continue;
      united = united.united({static_cast<int>(b.u0) - 1, static_cast<int>(b.v0) - 1,
                              static_cast<int>(b.u1) + 3, static_cast<int>(b.v1) + 3});
    }
  }
  return united.intersected({0, 0, v.width, v.height});
}

}  // namespace parhelion::render
