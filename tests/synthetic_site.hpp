// A building that is known to the millimetre, and what a 3D scanner that stood in it would have measured.
#pragma once

#include <cmath>
#include <numbers>
#include <random>

#include "fusion/cloud/point_cloud.hpp"
#include "fusion/scan/building_tree.hpp"
#include "protocols/model.hpp"
#include "tests/model_box.hpp"

namespace parhelion::test {

/// Two rooms, 6 x 5 m and 4 x 5 m, 2.6 m high, floor at z = 0. Between them a wall with an open doorway and
/// one with a door in a recess; a pillar, a table, a cupboard, five steps of 0.17 m to a landing.
inline SemanticModel synthetic_site() {
  constexpr double h = 2.6, m = h / 2;
  SemanticModel site;
  const auto add = [&](const std::string& name, EntityLabel label, const Eigen::Vector3d& centre,
                       const Eigen::Vector3d& size) {
    site.entities.push_back(model_box(name, label, centre, size));
  };
  using L = EntityLabel;
  add("floor", L::floor, {2, 0, -0.1}, {10.4, 5.4, 0.2});
  add("ceiling", L::ceiling, {2, 0, h + 0.1}, {10.4, 5.4, 0.2});
  add("wall south", L::wall, {2, -2.6, m}, {10.4, 0.2, h});
  add("wall north", L::wall, {2, 2.6, m}, {10.4, 0.2, h});
  add("wall west", L::wall, {-3.1, 0, m}, {0.2, 5, h});
  add("wall east", L::wall, {7.1, 0, m}, {0.2, 5, h});
  // The wall between, from y = -2.5 to 2.5, with a doorway from 0.2 to 1.1.
  add("wall middle 1", L::wall, {3.05, -1.15, m}, {0.1, 2.7, h});
  add("wall middle 2", L::wall, {3.05, 1.8, m}, {0.1, 1.4, h});
  add("wall over the doorway", L::wall_above_door, {3.05, 0.65, (2.05 + h) / 2}, {0.1, 0.9, h - 2.05});
  add("pillar", L::pillar, {-1.2, 1.2, m}, {0.35, 0.35, h});
  add("table top", L::unknown, {0.4, -1.5, 0.72}, {1.4, 0.7, 0.06});
  for (const double dx : {-0.62, 0.62}) {
    for (const double dy : {-0.28, 0.28})
      add("leg", L::unknown, {0.4 + dx, -1.5 + dy, 0.345}, {0.06, 0.06, 0.69});
  }
  add("cupboard", L::unknown, {-2.75, -1.2, 0.6}, {0.45, 1.2, 1.2});
  for (int step = 0; step < 5; ++step) {
    const double top = 0.17 * (step + 1);
    add("step", L::stairs, {4.9 + 0.28 * step, -1.8, top / 2}, {0.28, 1.3, top});
  }
  add("landing", L::unknown, {6.66, -1.8, 0.425}, {0.68, 1.3, 0.85});
  return site;
}

/// Rays in all directions, `step` apart (rad), from each viewpoint; noise along the ray. The cloud's frame is
/// the first scanner's: its origin where that stood, turned by `yaw` about z.
inline cloud::PointCloud<Cloud> scan_of(const SemanticModel& site,
                                        const std::vector<Eigen::Vector3d>& viewpoints, double step = 0.0087,
                                        double noise = 0.004, double yaw = 0) {
  const scan::BuildingTree tree(site);
  const Transform<Cloud, Map> T_cloud_map =
      Transform<Map, Cloud>::planar(viewpoints.at(0).x(), viewpoints[0].y(), yaw, viewpoints[0].z())
          .inverse();
  std::mt19937_64 random(11);
  std::normal_distribution<double> error;  // times noise, which may be 0
  cloud::PointCloud<Cloud> cloud;
  for (std::size_t v = 0; v < viewpoints.size(); ++v) {
    cloud.viewpoints.push_back(T_cloud_map * viewpoints[v]);
    for (double elevation = -1.35; elevation < 1.5; elevation += step) {
      const double around = step / std::max(0.1, std::cos(elevation));
      for (double azimuth = 0; azimuth < 2 * std::numbers::pi; azimuth += around) {
        const Eigen::Vector3d along(std::cos(elevation) * std::cos(azimuth),
                                    std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
        const auto hit = tree.cast(viewpoints[v], along, 30);
        if (!std::isfinite(hit.range)) continue;
        const Eigen::Vector3d p = viewpoints[v] + (hit.range + noise * error(random)) * along;
        cloud.points.push_back((T_cloud_map * p).cast<float>());
        cloud.scans.push_back(static_cast<std::uint16_t>(v));
      }
    }
  }
  return cloud;
}

inline cloud::PointCloud<Cloud> scan_of_site(double step = 0.0087) {
  return scan_of(synthetic_site(), {{0, 0, 1.3}, {-1.8, -0.4, 1.3}, {5, 1.2, 1.3}, {2.2, 1.9, 1.3}}, step);
}

}  // namespace parhelion::test
