#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <utility>

#include "fusion/cloud/parallel.hpp"
#include "fusion/semantic/carrier_points.hpp"
#include "fusion/semantic/net/net_entities.hpp"
#include "fusion/semantic/segmentation/floor_points.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kNear = 0.06;                       ///< m, tolerance around a box for points on its surface
constexpr double kEndsBelow = 0.4, kOverTop = 0.15;  ///< m, a wall's top under the ceiling; points over it

/// Boxes whose points get their label, where surfaces give none.
std::vector<const ModelEntity*> boxes_of(const SemanticNet& net) {
  std::vector<const ModelEntity*> boxes;
  for (const ModelEntity& entity : net.entities) {
    const bool boxed = entity.label == EntityLabel::door || entity.label == EntityLabel::pillar ||
                       entity.label == EntityLabel::stairs || entity.label == EntityLabel::wall_above_door ||
                       entity.label == EntityLabel::window;
    if (boxed) boxes.push_back(&entity);
  }
  return boxes;
}

/// Boxes by the plan cells that they touch: a site has many doors, but only few are near a point.
class BoxesByPlace {
 public:
  explicit BoxesByPlace(const std::vector<const ModelEntity*>& entities) {
    for (const ModelEntity* entity : entities) {
      const Eigen::Isometry3d T_body_map = entity->T_map_body.isometry().inverse();
      const Eigen::Vector3f half = (0.5 * entity->size.array() + kNear).cast<float>();
      const Eigen::Vector2d centre = entity->T_map_body.translation().head<2>();
      const double reach = half.head<2>().norm();
      const auto index = static_cast<std::uint32_t>(boxes_.size());
      boxes_.push_back({T_body_map.linear().cast<float>(), T_body_map.translation().cast<float>(), half,
                        static_cast<std::uint8_t>(entity->label)});
      for (int y = cell(centre.y() - reach); y <= cell(centre.y() + reach); ++y) {
        for (int x = cell(centre.x() - reach); x <= cell(centre.x() + reach); ++x)
          by_cell_[{x, y}].push_back(index);
      }
    }
  }
  /// Labels points one after the other: the next one is mostly in the same cell.
  class Labeller {
   public:
    explicit Labeller(const BoxesByPlace& boxes) : boxes_(boxes), cell_{cell(0), cell(0)} { look_up(); }
    /// The last box that holds the point gives its label.
    void label(const Eigen::Vector3f& point, std::uint8_t& label) {
      const Cell at{cell(point.x()), cell(point.y())};
      if (at != cell_) cell_ = at, look_up();
      for (const std::uint32_t index : here_) {
        const Box& box = boxes_.boxes_[index];
        if (((box.R * point + box.p).array().abs() <= box.half.array()).all()) label = box.label;
      }
    }

   private:
    void look_up() {
      const auto found = boxes_.by_cell_.find(cell_);
      here_ = found == boxes_.by_cell_.end() ? std::span<const std::uint32_t>{} : found->second;
    }
    const BoxesByPlace& boxes_;
    std::pair<int, int> cell_;
    std::span<const std::uint32_t> here_;
  };

 private:
  using Cell = std::pair<int, int>;
  struct Box {
    Eigen::Matrix3f R;
    Eigen::Vector3f p, half;
    std::uint8_t label;
  };
  static int cell(double v) { return static_cast<int>(std::floor(v)); }  // of 1 m
  std::vector<Box> boxes_;
  std::map<Cell, std::vector<std::uint32_t>> by_cell_;
};

/// Whether a candidate is the other face of one that is labelled wall.
bool is_other_face(const std::vector<WallCandidate>& walls, const Labelling& labelling, std::size_t w) {
  if (labelling.walls[w].label == EntityLabel::wall) return false;
  for (std::size_t front = 0; front < walls.size(); ++front) {
    if (labelling.walls[front].label == EntityLabel::wall && back_face(walls[front], walls[w])) return true;
  }
  return false;
}

}  // namespace

void label_points(const cloud::PointCloud<Map>& cloud, const NetCandidates& candidates,
                  const Labelling& labelling, SemanticNet& net) {
  const Segmentation& segmentation = candidates.segmentation;
  std::vector<EntityLabel> of_surface(segmentation.verticals.size() + segmentation.horizontals.size(),
                                      EntityLabel::unknown);
  // What lies over a wall in its plane is another thing: furniture of the storey above.
  std::vector<float> top(of_surface.size(), std::numeric_limits<float>::lowest());
  for (std::size_t w = 0; w < labelling.walls.size(); ++w) {
    const WallCandidate& wall = candidates.walls.walls[w];
    const EntityLabel label =
        is_other_face(candidates.walls.walls, labelling, w) ? EntityLabel::wall : labelling.walls[w].label;
    const bool ends = wall.curve == kNoCurve && wall.ceiling - wall.z_high > kEndsBelow;
    const float of_wall =
        ends ? static_cast<float>(wall.z_high + kOverTop) : std::numeric_limits<float>::max();
    // A surface may go through several storeys.
    for (const std::uint32_t surface : wall.surfaces) {
      if (of_surface[surface] != EntityLabel::wall) of_surface[surface] = label;
      if (label == EntityLabel::wall) top[surface] = std::max(top[surface], of_wall);
    }
  }
  for (std::size_t h = 0; h < labelling.horizontals.size(); ++h)
    of_surface[segmentation.verticals.size() + h] = labelling.horizontals[h].label;
  net.labels.resize(cloud.size());
  const BoxesByPlace boxes(boxes_of(net));
  constexpr std::size_t kChunk = 16'384;
  cloud::for_each_chunk(cloud.size(), kChunk, 0, [&](std::size_t, std::size_t begin, std::size_t end) {
    BoxesByPlace::Labeller labeller(boxes);
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t surface = segmentation.surface_of[i];
      const bool over = surface != kNoSurface && of_surface[surface] == EntityLabel::wall &&
                        cloud.points[i].z() > top[surface];
      net.labels[i] = static_cast<std::uint8_t>(surface == kNoSurface || over ? EntityLabel::unknown
                                                                              : of_surface[surface]);
      labeller.label(cloud.points[i], net.labels[i]);
    }
  });
  grow_floors(cloud, net.labels);
  drop_carriers(cloud, net.labels);
}

}  // namespace parhelion::semantic
