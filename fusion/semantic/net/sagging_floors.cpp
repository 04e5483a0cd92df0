#include "fusion/semantic/net/sagging_floors.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kBeside = 0.6;              // m, maximum gap between two parts of one floor
constexpr double kDeepest = 0.5;             // m: larger errors do not occur where a floor is seen at all
constexpr double kSkin = 0.12;               // m, of points around a floor
constexpr double kMargin = 0.2;              // m, around a floor's box
constexpr std::size_t kFewest = 50;          // minimum number of points for the angular error
constexpr std::size_t kMaxPoints = 500'000;  // maximum number of points used

struct Floor {
  std::size_t entity = 0;
  double top = 0;            ///< m
  Eigen::AlignedBox2d plan;  ///< m
};

std::vector<Floor> floors_of(const SemanticModel& model) {
  std::vector<Floor> floors;
  for (std::size_t i = 0; i < model.entities.size(); ++i) {
    const ModelEntity& e = model.entities[i];
    if (e.label != EntityLabel::floor || !is_solid(e) || e.is_virtual || e.locked) continue;
    Floor floor{i, e.T_map_body.translation().z() + e.size.z() / 2, {}};
    for (const double x : {-0.5, 0.5}) {
      for (const double y : {-0.5, 0.5}) {
        const Eigen::Vector3d corner = e.T_map_body * Eigen::Vector3d(x * e.size.x(), y * e.size.y(), 0);
        floor.plan.extend(corner.head<2>().eval());
      }
    }
    floors.push_back(floor);
  }
  return floors;
}

/// Of the floor's points: horizontal distance from their scanner, and depth below `height`; m.
std::vector<Eigen::Vector2d> sights_of(const cloud::PointCloud<Map>& cloud, const Floor& floor,
                                       double height) {
  std::vector<Eigen::Vector2d> sights;
  const Eigen::AlignedBox2d plan((floor.plan.min().array() - kMargin).matrix(),
                                 (floor.plan.max().array() + kMargin).matrix());
  const std::size_t stride = std::max<std::size_t>(1, cloud.size() / kMaxPoints);
  for (std::size_t i = 0; i < cloud.size(); i += stride) {
    if (cloud.labels[i] != static_cast<std::uint8_t>(EntityLabel::floor)) continue;
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    if (std::abs(p.z() - floor.top) > kSkin || !plan.contains(p.head<2>())) continue;
    const std::size_t scan = cloud.scans.empty() ? 0 : cloud.scans[i];
    if (scan >= cloud.viewpoints.size()) continue;
    const double away = (p - cloud.viewpoints[scan]).head<2>().norm();
    if (away > 0) sights.emplace_back(away, height - p.z());
  }
  return sights;
}

/// rad, 90th percentile of the angular error of the farther half of a floor's points.
std::optional<double> angles_off(const std::vector<Eigen::Vector2d>& sights) {
  if (sights.size() < 2 * kFewest) return std::nullopt;
  std::vector<double> away, off;
  for (const Eigen::Vector2d& sight : sights) away.push_back(sight.x());
  const double middle = quantile(away, 0.5);
  for (const Eigen::Vector2d& sight : sights) {
    if (sight.x() > middle) off.push_back(std::abs(sight.y()) / sight.x());
  }
  return off.empty() ? std::nullopt : std::optional(quantile(off, 0.9));
}

/// Whether errors of that size explain the height of `lower` relative to the floor at `height`.
bool sags(const cloud::PointCloud<Map>& cloud, const Floor& lower, double height, double max_slope) {
  std::vector<double> off;
  for (const Eigen::Vector2d& sight : sights_of(cloud, lower, height)) off.push_back(sight.y() / sight.x());
  return off.size() >= kFewest && quantile(off, 0.5) <= max_slope;
}

}  // namespace

std::size_t join_sagging_floors(const cloud::PointCloud<Map>& cloud, SemanticModel& model) {
  if (cloud.viewpoints.empty() || cloud.labels.size() != cloud.size()) return 0;
  std::vector<Floor> floors = floors_of(model);
  std::stable_sort(floors.begin(), floors.end(),
                   [](const Floor& a, const Floor& b) { return a.plan.volume() > b.plan.volume(); });
  std::vector<bool> gone(model.entities.size(), false);
  for (std::size_t g = 0; g < floors.size(); ++g) {
    if (gone[floors[g].entity]) continue;
    ModelEntity& larger = model.entities[floors[g].entity];
    if (larger.T_map_body.rotation()(2, 2) < 1 - 1e-9) continue;
    const auto max_slope = angles_off(sights_of(cloud, floors[g], floors[g].top));
    for (std::size_t h = g + 1; max_slope && h < floors.size(); ++h) {
      const double below = floors[g].top - floors[h].top;
      if (gone[floors[h].entity] || below <= 0 || below > kDeepest) continue;
      if (floors[g].plan.exteriorDistance(floors[h].plan) > kBeside) continue;
      if (!sags(cloud, floors[h], floors[g].top, *max_slope)) continue;
      gone[floors[h].entity] = true;
      floors[g].plan.extend(floors[h].plan);
      for (Relation& relation : model.relations) {
        for (std::string* end : {&relation.from, &relation.to}) {
          if (*end == model.entities[floors[h].entity].name) *end = larger.name;
        }
      }
      const Eigen::Vector2d centre = floors[g].plan.center(), size = floors[g].plan.sizes();
      larger.T_map_body =
          Transform<Map, Body>::planar(centre.x(), centre.y(), 0, larger.T_map_body.translation().z());
      larger.size.head<2>() = size;
    }
  }
  std::vector<ModelEntity> kept;
  for (std::size_t i = 0; i < gone.size(); ++i) {
    if (!gone[i]) kept.push_back(std::move(model.entities[i]));
  }
  const std::size_t joined = gone.size() - kept.size();
  model.entities = std::move(kept);
  std::erase_if(model.relations, [](const Relation& r) { return r.from == r.to; });
  return joined;
}

}  // namespace parhelion::semantic
