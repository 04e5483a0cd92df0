#include "server/runtime/live_site.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "fusion/cloud/registration.hpp"
#include "fusion/cloud/sensor_cloud.hpp"
#include "fusion/semantic/net/drop_doubles.hpp"
#include "fusion/semantic/net/observed_floors.hpp"
#include "fusion/semantic/net/semantic_net.hpp"
#include "fusion/semantic/unknown_mesh.hpp"
#include "render/depth_image.hpp"

namespace parhelion::runtime {
namespace {

constexpr std::size_t kMinTargetPoints = 2000;  ///< points required for registration
constexpr std::size_t kMinNewPoints = 200;      ///< points required for a new model
constexpr double kAround = 0.5;  ///< m around a view, region of the cloud used for registration

/// Boxes of a model, each grown by `reach`, to test whether a position is modelled.
class Modelled {
 public:
  Modelled(const SemanticModel& model, double reach) {
    for (const ModelEntity& entity : model.entities) {
      // Deleted entities are not added again.
      if (entity.label != EntityLabel::free_space)
        boxes_.push_back(
            {entity.T_map_body.isometry().inverse(), 0.5 * entity.size.array() + reach, entity.label});
    }
  }
  /// The label of the first box that contains the point.
  std::optional<EntityLabel> at(const Eigen::Vector3d& p) const {
    for (const Box& box : boxes_) {
      if (((box.T_body_map * p).array().abs() <= box.half).all()) return box.label;
    }
    return std::nullopt;
  }
  /// Whether most of an entity lies inside boxes.
  bool has(const ModelEntity& entity) const {
    constexpr int kSteps = 5;  // sample points along each axis
    int inside = 0;
    for (int i = 0; i < kSteps * kSteps * kSteps; ++i) {
      const Eigen::Vector3d s(i % kSteps, i / kSteps % kSteps, i / (kSteps * kSteps));
      const Eigen::Vector3d p = ((s.array() + 0.5) / kSteps - 0.5) * entity.size.array();
      inside += at(entity.T_map_body * p).has_value() ? 1 : 0;
    }
    return 2 * inside > kSteps * kSteps * kSteps;
  }

 private:
  struct Box {
    Eigen::Isometry3d T_body_map;
    Eigen::Array3d half;
    EntityLabel label;
  };
  std::vector<Box> boxes_;
};

using Cube = Eigen::Vector3i;

Cube cube_of(const Eigen::Vector3f& p, double size) {
  return (p.cast<double>() / size).array().floor().cast<int>();
}

/// 21 bits per axis: 60 km at 3 cm.
std::uint64_t key_of(const Cube& cube) {
  std::uint64_t key = 0;
  for (const int cell : cube) key = key << 21 | (static_cast<std::uint64_t>(cell + (1 << 20)) & 0x1FFFFF);
  return key;
}

/// Fuses the registration with the pose, weighted by their covariances (one step of a Kalman filter): along a
/// corridor the pose dominates, across it the walls do.
Eigen::Isometry3d as_far_as_determined(const cloud::Registration& found, const LiveSiteOptions& options) {
  const Eigen::AngleAxisd turn(found.T_target_source.rotation());
  Eigen::Matrix<double, 6, 1> moved;
  moved << found.T_target_source.translation(), turn.angle() * turn.axis();
  Eigen::Matrix<double, 6, 6> of_pose = Eigen::Matrix<double, 6, 6>::Zero();
  of_pose.diagonal().head<3>().setConstant(options.pose_sigma * options.pose_sigma);
  of_pose.diagonal().tail<3>().setConstant(options.turn_sigma * options.turn_sigma);
  moved = of_pose * (of_pose + found.covariance).ldlt().solve(moved);
  const Eigen::Vector3d rotation = moved.tail<3>();
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  if (rotation.norm() > 0)
    result.linear() = Eigen::AngleAxisd(rotation.norm(), rotation.normalized()).toRotationMatrix();
  result.translation() = moved.head<3>();
  return result;
}

std::string live(const std::string& name) { return name.empty() ? name : "live " + name; }

}  // namespace

LiveSite::LiveSite(SemanticModel start, const LiveSiteOptions& options)
    : start_(std::move(start)), options_(options) {}

Result<std::optional<SemanticModel>> LiveSite::add(const SiteView& view) {
  const auto cloud = seen(view);
  if (!cloud) return cloud.error();
  if (cloud_.viewpoints.size() + cloud->viewpoints.size() > std::numeric_limits<std::uint16_t>::max() ||
      cloud_.size() >= options_.max_points)
    return Error{"the live cloud is full: " + std::to_string(cloud_.size()) + " points of " +
                 std::to_string(cloud_.viewpoints.size()) + " viewpoints"};
  if (cloud->size() < kMinNewPoints) return std::optional<SemanticModel>();
  const auto T_map_seen = correction(*cloud);
  if (!T_map_seen) return T_map_seen.error();
  if (merge(cloud::transformed(*T_map_seen, *cloud)) < kMinNewPoints) return std::optional<SemanticModel>();
  auto made = model();
  if (!made) return made.error();
  return std::optional<SemanticModel>(std::move(*made));
}

/// The view's points, placed by its poses.
Result<cloud::PointCloud<Map>> LiveSite::seen(const SiteView& view) const {
  if (const auto* swept = std::get_if<LineView>(&view)) {
    LaserDescription laser = swept->laser;
    laser.convention.range_max =
        std::min(laser.convention.range_max, static_cast<float>(options_.line_range));
    return cloud::cloud_from_lines(swept->lines, laser, swept->body);
  }
  const auto& [depth, camera, T_map_optical] = std::get<PlacedDepth>(view);
  const auto pixels = render::decode_depth(depth);
  if (!pixels) return pixels.error();
  const auto measured = cloud::cloud_from_depth(pixels->millimetres, camera.intrinsics,
                                                {options_.pixel_step, 0, options_.range});
  if (!measured) return measured.error();
  return cloud::transformed(T_map_optical, *measured);
}

Result<Transform<Map, Map>> LiveSite::correction(const cloud::PointCloud<Map>& seen) const {
  Eigen::AlignedBox3f bounds;
  for (const Eigen::Vector3f& p : seen.points) bounds.extend(p);
  const Eigen::Vector3f around = Eigen::Vector3f::Constant(static_cast<float>(kAround));
  bounds = {bounds.min() - around, bounds.max() + around};
  cloud::PointCloud<Map> near;
  for (std::size_t i = 0; i < cloud_.size(); ++i) {
    if (!bounds.contains(cloud_.points[i])) continue;
    near.points.push_back(cloud_.points[i]);
    near.scans.push_back(cloud_.scans[i]);
  }
  if (near.size() < kMinTargetPoints) return Transform<Map, Map>();
  near.viewpoints = cloud_.viewpoints;
  // Relative to the view's centre, where corrections are small, not to the map's origin.
  const Eigen::Vector3d centre = bounds.center().cast<double>();
  const Transform<cloud::Target, Map> T_target_map(Eigen::Quaterniond::Identity(), -centre);
  cloud::RegistrationOptions options;
  options.max_distance = options_.largest_correction;
  options.doubt_turns = false;  // the pose is more certain than that, and
  options.other_starts = false;
  options.threads = 1;  // the tick needs the other core
  const auto found =
      cloud::register_pair(cloud::transformed(T_target_map, near),
                           cloud::renamed<cloud::Source>(cloud::transformed(T_target_map, seen)),
                           Transform<cloud::Target, cloud::Source>(), options);
  if (!found) return found.error();
  if (!found->converged && found->overlap < options.min_overlap) return Transform<Map, Map>();  // new ground
  if (!found->converged && !found->undetermined) return Error{"the view was not matched: " + found->why};
  const Eigen::Isometry3d moved =
      found->converged ? found->T_target_source.isometry() : as_far_as_determined(*found, options_);
  const double shift = moved.translation().norm();
  const double turn = Eigen::AngleAxisd(moved.linear()).angle();
  if (shift > options_.largest_correction || turn > options_.largest_turn)
    return Error{"the view fits " + std::to_string(shift) + " m and " + std::to_string(turn) +
                 " rad away from its pose: left out"};
  return Transform<Map, Map>(Eigen::Translation3d(centre) * moved * Eigen::Translation3d(-centre));
}

std::size_t LiveSite::merge(const cloud::PointCloud<Map>& seen) {
  const std::size_t first_scan = cloud_.viewpoints.size();
  cloud_.viewpoints.insert(cloud_.viewpoints.end(), seen.viewpoints.begin(), seen.viewpoints.end());
  const auto near = static_cast<float>(options_.spacing);
  const auto is_there = [&](const Eigen::Vector3f& p, const Cube& cube) {
    for (int i = 0; i < 27; ++i) {
      const auto found = point_in_.find(key_of(cube + Cube(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)));
      if (found != point_in_.end() && (cloud_.points[found->second] - p).squaredNorm() < near * near)
        return true;
    }
    return false;
  };
  std::size_t added = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Eigen::Vector3f& p = seen.points[i];
    const Cube cube = cube_of(p, options_.spacing);
    if (is_there(p, cube)) continue;
    point_in_[key_of(cube)] = static_cast<std::uint32_t>(cloud_.size());
    cloud_.points.push_back(p);
    cloud_.scans.push_back(static_cast<std::uint16_t>(first_scan + (seen.scans.empty() ? 0 : seen.scans[i])));
    ++added;
  }
  return added;
}

Result<SemanticModel> LiveSite::model() const {
  semantic::SegmentationOptions segmenting;
  segmenting.threads = 1;  // the tick needs the other core
  const auto segmentation = semantic::segment(cloud_, segmenting);
  if (!segmentation) return segmentation.error();
  auto net = semantic::label_entities(cloud_, *segmentation);
  if (!net) return net.error();
  SemanticModel found;
  found.entities = std::move(net->entities);
  found.relations = std::move(net->relations);
  semantic::cut_floors(semantic::EvidenceGrid(cloud_), found);
  const Modelled modelled(start_, options_.explained);
  SemanticModel result = start_;
  std::set<std::string> added;
  for (ModelEntity entity : found.entities) {
    if (modelled.has(entity)) continue;
    added.insert(entity.name);
    entity.name = live(entity.name);
    entity.part_of = live(entity.part_of);
    result.entities.push_back(std::move(entity));
  }
  for (const Relation& relation : found.relations) {
    if (added.contains(relation.from) && added.contains(relation.to))
      result.relations.push_back(
          {relation.kind, live(relation.from), live(relation.to), relation.confidence});
  }
  semantic::drop_doubles(result, start_.entities.size());
  for (std::size_t i = 0; i < cloud_.size(); ++i) {
    if (net->labels[i] != static_cast<std::uint8_t>(EntityLabel::unknown)) continue;
    if (const auto label = modelled.at(cloud_.points[i].cast<double>())) {
      // Points in modelled boxes get a label, because `unknown` ones would be meshed again.
      net->labels[i] = static_cast<std::uint8_t>(*label == EntityLabel::unknown ? EntityLabel::wall : *label);
    }
  }
  auto mesh = semantic::unknown_mesh(cloud_, net->labels);
  if (!mesh) return mesh.error();
  if (!mesh->mesh.empty()) {
    mesh->mesh.name = live(mesh->mesh.name);
    result.meshes.push_back(std::move(mesh->mesh));
  }
  return result;
}

}  // namespace parhelion::runtime
