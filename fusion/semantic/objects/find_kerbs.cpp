#include "fusion/semantic/objects/find_kerbs.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "fusion/semantic/net/ground_layers.hpp"
#include "fusion/semantic/net/plan_areas.hpp"
#include "fusion/semantic/objects/kerb_edge.hpp"
#include "fusion/semantic/objects/kerb_lines.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kLowest = 0.05;  // m, of the step
constexpr double kDeep = 0.15;    // m, of the box behind the edge

/// The points around each line, on both grounds and between them.
std::vector<std::vector<EdgePoint>> points_at(const std::vector<KerbLine>& lines,
                                              const cloud::PointCloud<Map>& cloud,
                                              std::span<const std::uint8_t> labels) {
  PlanAreas areas;
  for (const KerbLine& candidate : lines) {
    const KerbAxis& line = candidate.line;
    areas.add(line.place(0.5 * (line.from + line.to)), line.along,
              {0.5 * (line.to - line.from) + kKerbReach, kKerbReach + kKerbBin});
  }
  std::vector<std::vector<EdgePoint>> at(lines.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const auto label = static_cast<EntityLabel>(labels[i]);
    if (!is_ground(label) && label != EntityLabel::unknown) continue;
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    for (const std::uint32_t k : areas.near(p.head<2>())) {
      const double h = (p.z() - lines[k].low.height(p.head<2>())) / lines[k].rise;
      if (h < -0.5 || h > 1.5) continue;
      const Eigen::Vector2d on = lines[k].line.at(p.head<2>());
      at[k].push_back({on.x(), on.y(), h, is_ground(label)});
    }
  }
  return at;
}

/// Whether most of it lies at a step of a flight, or at a ramp.
bool is_of_entity(const ModelObject& kerb, const std::vector<ModelEntity>& entities) {
  constexpr double margin = 0.35;
  constexpr int samples = 16;
  int inside = 0;
  for (int s = 0; s < samples; ++s) {
    const Eigen::Vector3d p =
        kerb.T_map_body * Eigen::Vector3d(((s + 0.5) / samples - 0.5) * kerb.size.x(), -kerb.size.y() / 2, 0);
    inside += std::any_of(entities.begin(), entities.end(), [&](const ModelEntity& e) {
      if ((e.label != EntityLabel::stairs && e.label != EntityLabel::ramp) || !is_solid(e)) return false;
      const Eigen::Vector3d at = e.T_map_body.inverse() * p;
      return std::abs(at.x()) < e.size.x() / 2 + margin && std::abs(at.y()) < e.size.y() / 2 + margin &&
             std::abs(at.z()) < e.size.z() / 2 + margin;
    });
  }
  return 2 * inside > samples;
}

ModelObject object_of(const KerbLine& candidate, const KerbEdge& edge) {
  const double u = 0.5 * (edge.from + edge.to), tilt = std::atan(edge.slope);
  const KerbAxis& line = candidate.line;
  const Eigen::Vector2d along = (line.along + edge.slope * line.up).normalized(), up(-along.y(), along.x());
  const Eigen::Vector2d on_edge = line.place(u) + (edge.offset + edge.slope * u) * line.up,
                        middle = on_edge + kDeep / 2 * up;
  const double ground = candidate.low.height(on_edge), bottom = ground + edge.low * candidate.rise,
               top = ground + edge.high * candidate.rise;
  ModelObject kerb;
  kerb.kind = ObjectKind::kerb;
  kerb.T_map_body = Transform<Map, Body>(
      Eigen::Quaterniond(Eigen::AngleAxisd(std::atan2(along.y(), along.x()), Eigen::Vector3d::UnitZ())),
      Eigen::Vector3d(middle.x(), middle.y(), 0.5 * (bottom + top)));
  kerb.size = {(edge.to - edge.from) / std::cos(tilt), kDeep, top - bottom};
  kerb.confidence = std::min(1.0, edge.measured);
  kerb.movable = false;
  return kerb;
}

/// Whether most of `kerb` lies along `other`.
bool is_same(const ModelObject& kerb, const ModelObject& other) {
  const Eigen::Vector3d at = other.T_map_body.inverse() * kerb.T_map_body.translation();
  const double turn = std::abs(std::sin(kerb.T_map_body.yaw() - other.T_map_body.yaw()));
  return std::abs(at.x()) < other.size.x() / 2 && std::abs(at.y()) < 0.4 && turn < 0.3;
}

}  // namespace

std::vector<ModelObject> find_kerbs(const cloud::PointCloud<Map>& cloud, std::span<const std::uint8_t> labels,
                                    const std::vector<ModelEntity>& entities, double voxel) {
  const std::vector<KerbLine> lines = kerb_lines(GroundLayers(cloud, labels), std::max(kLowest, 2 * voxel));
  if (lines.empty()) return {};
  const auto points = points_at(lines, cloud, labels);
  std::vector<ModelObject> kerbs;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const auto edge = kerb_edge(lines[k].line, points[k]);
    if (!edge) continue;
    ModelObject kerb = object_of(lines[k], *edge);
    const auto is_known = [&](const ModelObject& other) { return is_same(kerb, other); };
    if (is_of_entity(kerb, entities) || std::any_of(kerbs.begin(), kerbs.end(), is_known)) continue;
    kerb.name = "kerb " + std::to_string(kerbs.size() + 1);
    kerbs.push_back(std::move(kerb));
  }
  return kerbs;
}

}  // namespace parhelion::semantic
