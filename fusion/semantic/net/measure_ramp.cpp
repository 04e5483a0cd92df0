#include "fusion/semantic/net/measure_ramp.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "fusion/semantic/net/ground_layers.hpp"
#include "fusion/semantic/net/plan_areas.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

bool may_be_ramp(std::uint8_t label) {
  return label == static_cast<std::uint8_t>(EntityLabel::floor) ||
         label == static_cast<std::uint8_t>(EntityLabel::unknown);
}

/// How far from a ramp the floor is looked at, m.
constexpr double kAround = 3;

}  // namespace

std::vector<std::vector<std::uint32_t>> points_around_ramps(const cloud::PointCloud<Map>& cloud,
                                                            std::span<const std::uint8_t> labels,
                                                            const std::vector<ModelEntity>& ramps) {
  PlanAreas areas;
  for (const ModelEntity& ramp : ramps) {
    const Eigen::Vector2d along = ramp.T_map_body.rotation().col(0).head<2>().normalized();
    areas.add(ramp.T_map_body.translation().head<2>(), along, 0.5 * ramp.size.head<2>().array() + kAround);
  }
  std::vector<std::vector<std::uint32_t>> around(ramps.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!may_be_ramp(labels[i])) continue;
    for (const std::uint32_t r : areas.near(cloud.points[i].head<2>().cast<double>()))
      around[r].push_back(static_cast<std::uint32_t>(i));
  }
  return around;
}

void fit_width(const cloud::PointCloud<Map>& cloud, std::span<const std::uint32_t> around,
               ModelEntity& ramp) {
  constexpr std::size_t fewest = 50;
  constexpr double outermost = 0.005;  // of the points: outliers
  std::vector<double> across;
  const Transform<Body, Map> T_ramp_map = ramp.T_map_body.inverse();
  for (const std::uint32_t i : around) {
    const Eigen::Vector3d p = T_ramp_map * cloud.points[i].cast<double>();
    if (p.x() > 0 && p.x() < 0.45 * ramp.size.x() &&
        std::abs(p.y()) < ramp.size.y() / 2 + GroundLayers::kCell &&
        std::abs(p.z() - ramp.size.z() / 2) < kOnRamp)
      across.push_back(p.y());
  }
  if (across.size() < fewest) return;
  const double low = quantile(across, outermost), high = quantile(across, 1 - outermost);
  ramp.T_map_body = ramp.T_map_body * Transform<Body, Body>::planar(0, 0.5 * (low + high), 0, 0);
  ramp.size.y() = high - low;
}

double height_error(const cloud::PointCloud<Map>& cloud, std::span<const std::uint8_t> labels,
                    std::span<const std::uint32_t> around, const ModelEntity& ramp, double floor) {
  constexpr double skin = 0.12;  // m
  constexpr std::size_t fewest = 50;
  if (cloud.viewpoints.empty()) return 0;
  const Transform<Body, Map> T_ramp_map = ramp.T_map_body.inverse();
  const bool at_foot = floor < (ramp.T_map_body * Eigen::Vector3d(0, 0, ramp.size.z() / 2)).z();
  std::vector<double> off, away;  // of the floor: rad; of the ramp: m from its scanner
  for (const std::uint32_t i : around) {
    const std::size_t scan = cloud.scans.empty() ? 0 : cloud.scans[i];
    if (scan >= cloud.viewpoints.size()) continue;
    const Eigen::Vector3d p = cloud.points[i].cast<double>(), at = T_ramp_map * p;
    const double outside = (at.head<2>().cwiseAbs() - 0.5 * ramp.size.head<2>()).maxCoeff();
    const double distance = (p - cloud.viewpoints[scan]).head<2>().norm();
    if (outside > kAround || !(distance > 0)) continue;
    if (outside < 0 && std::abs(at.z() - ramp.size.z() / 2) < kOnRamp) away.push_back(distance);
    // Not beyond the other end, where another floor lies.
    if (outside > GroundLayers::kCell && (at.x() < 0) == at_foot && std::abs(p.z() - floor) < skin &&
        labels[i] == static_cast<std::uint8_t>(EntityLabel::floor))
      off.push_back(std::abs(p.z() - floor) / distance);
  }
  if (off.size() < fewest || away.size() < fewest) return 0;
  return quantile(off, 0.9) * quantile(away, 0.9);
}

bool is_on_ramp(const ModelEntity& ramp, const Eigen::Vector3d& at) {
  constexpr double edge = 0.08, skin = 1.5 * kOnRamp;  // m
  const Eigen::Vector3d p = ramp.T_map_body.inverse() * at;
  const double inside = (0.5 * ramp.size.head<2>() - p.head<2>().cwiseAbs()).minCoeff();  // m, of the edges
  const double over = p.z() - ramp.size.z() / 2;
  if (inside < -edge || over > skin) return false;
  const double rise = ramp.T_map_body.rotation()(2, 0) * (p.x() + ramp.size.x() / 2);  // over its foot
  return over > -skin || (inside < edge && over > -rise);
}

}  // namespace parhelion::semantic
