#include "fusion/cloud/sensor_cloud.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace parhelion::cloud {
namespace {

/// The distorted coordinates of a ray (x, y) = (X/Z, Y/Z).
Eigen::Vector2d distort(const CameraIntrinsics& camera, const Eigen::Vector2d& ray) {
  const auto& d = camera.distortion;
  const double r2 = ray.squaredNorm();
  if (camera.lens == CameraIntrinsics::Lens::fisheye) {
    const double r = std::sqrt(r2);
    if (r < 1e-12) return ray;
    const double theta = std::atan(r), t2 = theta * theta;
    return ray * (theta * (1 + t2 * (d[0] + t2 * (d[1] + t2 * (d[2] + t2 * d[3])))) / r);
  }
  const double radial = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
  const double x = ray.x(), y = ray.y();
  return {x * radial + 2 * d[2] * x * y + d[3] * (r2 + 2 * x * x),
          y * radial + d[2] * (r2 + 2 * y * y) + 2 * d[3] * x * y};
}

/// The ray whose distorted coordinates are `seen`: Newton with a numeric Jacobian; nullopt without
/// convergence.
std::optional<Eigen::Vector2d> undistort(const CameraIntrinsics& camera, const Eigen::Vector2d& seen) {
  Eigen::Vector2d ray = seen;
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector2d off = distort(camera, ray) - seen;
    if (!(off.norm() < 1e3)) return std::nullopt;
    if (off.norm() < 1e-9) return ray;
    constexpr double h = 1e-6;
    Eigen::Matrix2d J;
    for (int k = 0; k < 2; ++k) {
      const Eigen::Vector2d e = h * Eigen::Vector2d::Unit(k);
      J.col(k) = (distort(camera, ray + e) - distort(camera, ray - e)) / (2 * h);
    }
    if (std::abs(J.determinant()) < 1e-9) return std::nullopt;
    ray -= J.inverse() * off;
  }
  return std::nullopt;
}

Status check(std::size_t pixels, const CameraIntrinsics& camera, const DepthCloudOptions& options) {
  const auto size = std::to_string(camera.width) + " x " + std::to_string(camera.height);
  if (camera.width <= 0 || camera.height <= 0 ||
      pixels != static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height)) {
    return Error{"a depth image of " + std::to_string(pixels) + " pixels is not the camera's, " + size};
  }
  if (!(camera.fx > 0) || !(camera.fy > 0) || !std::isfinite(camera.cx) || !std::isfinite(camera.cy)) {
    return Error{"a depth camera needs fx > 0, fy > 0 and a finite centre, in pixels"};
  }
  if (options.step < 1 || !(options.range_min >= 0) || !(options.range_max > options.range_min)) {
    return Error{"expected step >= 1 and 0 <= range_min < range_max for a cloud from depth"};
  }
  return {};
}

/// Calls `take` with the beam's index and the point in the laser's frame.
template <class Take>
void each_hit(const Scan& line, const LaserDescription& laser, Take take) {
  for (std::size_t i = 0; i < line.ranges.size(); ++i) {
    if (laser.convention.classify(line.ranges[i]) != BeamKind::hit) continue;
    const double angle = line.angle(i);
    const double range = line.ranges[i];
    take(i, Eigen::Vector3d(range * std::cos(angle), range * std::sin(angle), 0));
  }
}

bool on_body(const OwnBody& body, const Eigen::Vector3d& p) {
  if (body.footprint.empty() || p.z() > body.height + body.margin || p.z() < -body.margin) return false;
  const std::size_t n = body.footprint.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector2d& a = body.footprint[i];
    const Eigen::Vector2d along = (body.footprint[(i + 1) % n] - a).normalized();
    const Eigen::Vector2d from = p.head<2>() - a;
    if (along.x() * from.y() - along.y() * from.x() < -body.margin) return false;
  }
  return true;
}

}  // namespace

Result<PointCloud<DepthOptical>> cloud_from_depth(std::span<const std::uint16_t> millimetres,
                                                  const CameraIntrinsics& camera,
                                                  const DepthCloudOptions& options) {
  if (Status status = check(millimetres.size(), camera, options); !status) return status.error();
  const bool distorted = camera.distortion != std::array<double, 5>{};
  PointCloud<DepthOptical> cloud;
  cloud.viewpoints.emplace_back(0, 0, 0);
  for (int v = 0; v < camera.height; v += options.step) {
    for (int u = 0; u < camera.width; u += options.step) {
      const std::uint16_t mm =
          millimetres[static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width) +
                      static_cast<std::size_t>(u)];
      const double z = mm * 0.001;
      if (mm == 0 || mm == 0xFFFF || z < options.range_min || z > options.range_max) continue;
      const Eigen::Vector2d seen((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy);
      const auto ray = distorted ? undistort(camera, seen) : seen;
      if (!ray) continue;
      cloud.points.emplace_back(static_cast<float>(ray->x() * z), static_cast<float>(ray->y() * z),
                                static_cast<float>(z));
    }
  }
  return cloud;
}

Result<LineCloud> cloud_from_lines(std::span<const Scan> lines, const LaserDescription& laser,
                                   const LaserPoseAt& pose_at) {
  LineCloud result;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  std::uint64_t placed = 0;
  for (const Scan& line : lines) {
    const std::size_t n = line.ranges.size();
    const auto pose_of = [&](std::size_t i) { return pose_at(line.stamp + laser.beam_time(i, line)); };
    const auto first = n == 0 ? std::nullopt : pose_of(0);
    if (!first || !pose_of(n - 1)) {
      ++result.without_pose;
      continue;
    }
    place += first->translation();
    ++placed;
    each_hit(line, laser, [&](std::size_t i, const Eigen::Vector3d& p_laser) {
      const auto pose = pose_of(i);
      if (!pose) return;
      const Eigen::Vector3d p = *pose * p_laser;
      if (p.allFinite()) result.cloud.points.push_back(p.cast<float>());
    });
  }
  if (placed == 0) return Error{"none of the " + std::to_string(lines.size()) + " scan lines has a pose"};
  if (result.cloud.empty()) return Error{"no beam of the scan lines hit anything"};
  result.cloud.viewpoints.push_back(place / static_cast<double>(placed));
  return result;
}

LineSpan line_span(const LaserDescription& laser, const Scan& line) {
  if (line.ranges.empty()) return {};
  LineSpan span{laser.beam_time(0, line), laser.beam_time(0, line)};
  for (std::size_t i = 1; i < line.ranges.size(); ++i) {
    const Duration t = laser.beam_time(i, line);
    span = {std::min(span.start, t), std::max(span.end, t)};
  }
  return span;
}

bool lies_level(const LaserDescription& laser) {
  constexpr double level = 0.94;  // cosine of 20 degrees
  return std::abs(laser.T_base_laser.rotation()(2, 2)) >= level;
}

void leave_out_body(Scan& line, const LaserDescription& laser, const Transform<Base, Laser>& T_base_laser,
                    const OwnBody& body) {
  if (body.footprint.empty()) return;
  each_hit(line, laser, [&](std::size_t i, const Eigen::Vector3d& p_laser) {
    if (on_body(body, T_base_laser * p_laser)) line.ranges[i] = std::numeric_limits<float>::quiet_NaN();
  });
}

PointCloud<Map> cloud_from_lines(std::span<const PlacedLine> lines, const LaserDescription& laser,
                                 const OwnBody& body, double viewpoint_distance) {
  PointCloud<Map> cloud;
  for (const PlacedLine& placed : lines) {
    const Eigen::Vector3d place = placed.T_map_laser_start.translation();
    if (cloud.viewpoints.empty() || (cloud.viewpoints.back() - place).norm() >= viewpoint_distance)
      cloud.viewpoints.push_back(place);
    const auto viewpoint = static_cast<std::uint16_t>(cloud.viewpoints.size() - 1);
    const LineSpan span = line_span(laser, placed.line);
    const double length = (span.end - span.start).seconds();
    each_hit(placed.line, laser, [&](std::size_t i, const Eigen::Vector3d& p_laser) {
      if (on_body(body, placed.T_base_laser * p_laser)) return;
      const double s = length > 0 ? (laser.beam_time(i, placed.line) - span.start).seconds() / length : 0;
      const Eigen::Vector3d p = interpolate(placed.T_map_laser_start, placed.T_map_laser_end, s) * p_laser;
      if (!p.allFinite()) return;
      cloud.points.push_back(p.cast<float>());
      cloud.scans.push_back(viewpoint);
    });
  }
  return cloud;
}

}  // namespace parhelion::cloud
