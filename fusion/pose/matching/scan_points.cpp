#include "fusion/pose/matching/scan_points.hpp"

#include <algorithm>
#include <limits>

#include "protocols/hash.hpp"

namespace parhelion::pose {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// A return from lower than this fraction of the laser's height is from the floor, as far as an inertial
/// sensor can tell.
constexpr double kFloor = 0.3;
constexpr double kCeiling = 2.2;  ///< m, the lowest ceilings

}  // namespace

Deskewing::Deskewing(const LaserDescription& laser, const SweepMotion& motion,
                     const std::optional<Attitude>& attitude)
    : laser_(laser),
      motion_(motion),
      T_base_laser_(attitude ? levelled(laser.T_base_laser, *attitude) : laser.T_base_laser),
      lowest_(attitude ? kFloor * T_base_laser_.translation().z() : -kInfinity),
      highest_(attitude ? std::max(kCeiling, T_base_laser_.translation().z()) : kInfinity) {}

std::optional<Eigen::Vector2d> Deskewing::point(const Scan& scan, std::size_t beam) const {
  if (laser_.convention.classify(scan.ranges[beam]) != BeamKind::hit) return std::nullopt;
  const double range = scan.ranges[beam];
  const double angle = scan.angle(beam);
  const Eigen::Vector3d p_laser(range * std::cos(angle), range * std::sin(angle), 0);
  const Eigen::Vector3d p = T_base_laser_ * p_laser;
  if (p.z() < lowest_ || p.z() > highest_) return std::nullopt;
  const Eigen::Vector2d p_base = p.head<2>();
  const double dt = motion_.at_rest() ? 0 : laser_.beam_time(beam, scan).seconds();
  return dt == 0 ? p_base : Eigen::Vector2d(motion_.after(dt) * p_base);
}

ScanPoints deskewed(const Scan& scan, const LaserDescription& laser, const SweepMotion& motion,
                    const std::optional<Attitude>& attitude) {
  const Deskewing deskewing(laser, motion, attitude);
  ScanPoints result;
  result.stamp = scan.stamp;
  result.laser = deskewing.laser();
  result.beams = scan.ranges.size();
  result.angle_min = scan.angle_min;
  result.angle_increment = scan.angle_increment;
  const auto bytes = std::as_bytes(std::span(scan.ranges));
  result.ranges_hash = fnv1a_of_blocks({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  result.points.reserve(scan.ranges.size());
  double times = 0;  // s from the stamp, their sum
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const auto point = deskewing.point(scan, i);
    if (!point) continue;
    result.points.push_back(*point);
    times += laser.beam_time(i, scan).seconds();
  }
  if (!result.points.empty() && !motion.at_rest())
    result.to_middle = motion.after(times / static_cast<double>(result.points.size()));
  return result;
}

namespace {

/// Range along the beam to its intersection with the line through a and b.
double range_to_line(double angle, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
  const Eigen::Vector2d along = b - a;
  const double cross = direction.x() * along.y() - direction.y() * along.x();
  return std::abs(cross) < 1e-9 ? a.norm() : (a.x() * along.y() - a.y() * along.x()) / cross;
}

}  // namespace

Scan rectified(const ScanPoints& scan, const LaserDescription& laser) {
  Scan result{scan.stamp,
              std::vector<float>(scan.beams, std::numeric_limits<float>::quiet_NaN()),
              {},
              scan.angle_min,
              scan.angle_increment,
              {},
              {}};
  const Transform<Laser, Base> T_laser_base = laser.T_base_laser.inverse();
  const double z = laser.T_base_laser.translation().z();
  const double first = static_cast<double>(scan.angle_min), step = static_cast<double>(scan.angle_increment);
  const auto put = [&](double beam, double range) {
    const auto i = std::lround(beam);
    if (i < 0 || i >= static_cast<long>(scan.beams)) return;
    float& own = result.ranges[static_cast<std::size_t>(i)];
    if (std::isnan(own) || range < static_cast<double>(own)) own = static_cast<float>(range);
  };
  double last_beam = 0;
  Eigen::Vector2d last(0, 0);
  for (std::size_t k = 0; k < scan.points.size(); ++k) {
    const Eigen::Vector2d p =
        (T_laser_base * Eigen::Vector3d(scan.points[k].x(), scan.points[k].y(), z)).head<2>();
    // Continuous index: unwrapped about the middle of the scan.
    const double middle = first + step * static_cast<double>(scan.beams) / 2;
    const double beam = (middle + wrap_angle(std::atan2(p.y(), p.x()) - middle) - first) / step;
    const bool neighbours =
        k > 0 && std::abs(beam - last_beam) < 2.5 && (p - last).norm() < 0.1 + 0.05 * p.norm();
    if (!neighbours) put(beam, p.norm());
    if (neighbours) {
      for (double i = std::ceil(std::min(beam, last_beam)); i <= std::max(beam, last_beam); ++i) {
        const double range = range_to_line(first + i * step, last, p);
        if (range > 0 && range < 1.2 * std::max(p.norm(), last.norm())) put(i, range);
      }
    }
    last = p;
    last_beam = beam;
  }
  return result;
}

std::vector<Eigen::Vector2d> thinned(std::span<const Eigen::Vector2d> points, std::size_t count) {
  if (points.size() <= count) return {points.begin(), points.end()};
  std::vector<Eigen::Vector2d> kept;
  kept.reserve(count);
  for (std::size_t i = 0; i < count; ++i) kept.push_back(points[i * points.size() / count]);
  return kept;
}

}  // namespace parhelion::pose
