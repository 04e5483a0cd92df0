#include "tools/calibration/laser_level.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <utility>

#include "tools/calibration/level_floor.hpp"

namespace parhelion::tools {
namespace {

constexpr std::size_t kMinImages = 10, kBeamsOfAScan = 20, kMinBeams = 300;
constexpr double kDegree = std::numbers::pi / 180;
/// 1 sigma: what is known worse is known better by a tape measure and a spirit level.
constexpr double kUsefulHeight = 0.05, kUsefulTilt = 1 * kDegree;
constexpr double kDescribedHeight = 0.1, kDescribedTilt = 2.5 * kDegree;  // 1 sigma
constexpr double kEdgePixels = 0.6, kEdgeHeight = 0.007;  // px, m: 1 sigma of the height of an edge
constexpr double kWrittenTilt = 0.3 * kDegree;            // 1 sigma, at most
constexpr double kLongest = 12;    // m: of things farther away depth images show no edges
constexpr double kPlace = 0.75;    // m
constexpr float kEdge = 0.15F;     // m, between beams at both sides of one
constexpr double kAgreeing = 0.5;  // minimum fraction of beams

Eigen::Matrix3d tilted(double pitch, double roll) {
  return (Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

/// Numbers of the places of a map, in the order in which they are asked for. In a large map several places
/// share a number.
class Places {
 public:
  std::uint8_t at(const Eigen::Vector2d& p) {
    const std::pair key{static_cast<int>(std::floor(p.x() / kPlace)),
                        static_cast<int>(std::floor(p.y() / kPlace))};
    const auto number = static_cast<std::uint8_t>(numbers_.size() % LevelPosterior::kPlaces);
    return numbers_.try_emplace(key, number).first->second;
  }

 private:
  std::map<std::pair<int, int>, std::uint8_t> numbers_;
};

/// Beside an edge a small error of the path decides what is seen.
bool is_beside_edge(const Scan& scan, std::size_t i) {
  return std::abs(scan.ranges[i - 2] - scan.ranges[i]) > kEdge ||
         std::abs(scan.ranges[i + 2] - scan.ranges[i]) > kEdge;
}

/// 2 sigma of a tilt that is written move no beam by more than 0.7 of the laser's height: SLAM takes what is
/// lower than 0.3 of it for the floor.
double written_tilt(double height, const LaserDescription& laser) {
  constexpr double kOfTheHeight = 0.35, kReach = 30;  // m, where the description gives none
  const double reach = laser.convention.range_max > 0 ? double{laser.convention.range_max} : kReach;
  return std::min(kWrittenTilt, std::atan(kOfTheHeight * height / reach));
}

/// What is known well, and not at the edge of what is looked at.
void set_shown(const LevelEstimate& estimate, const LaserDescription& laser, LaserLevel& result) {
  const Level &mean = estimate.mean, &sigma = estimate.sigma;
  const bool floor = result.camera.has_value();
  const double described = laser.T_base_laser.translation().z(), tilt = std::hypot(mean.pitch, mean.roll);
  const bool inside = mean.height - 2 * sigma.height > BeamOutcomes::height(0) &&
                      mean.height + 2 * sigma.height < BeamOutcomes::height(BeamOutcomes::kHeights - 1);
  result.height = floor && inside && sigma.height < kUsefulHeight
                      ? pose::Measured{mean.height, sigma.height, true}
                      : pose::Measured{described, kDescribedHeight, false};
  const auto turned = [&](double value, double deviation) {
    return floor && deviation < kUsefulTilt && tilt + 2 * deviation < LevelPosterior::steepest()
               ? pose::Measured{value, deviation, true}
               : pose::Measured{0, kDescribedTilt, false};
  };
  result.pitch = turned(mean.pitch, sigma.pitch);
  result.roll = turned(mean.roll, sigma.roll);
  const double limit = written_tilt(result.height.value, laser);
  const auto writes = [limit](const pose::Measured& found) {
    return found.shown && found.sigma <= limit && std::abs(found.value) >= 2 * found.sigma;
  };
  result.writes_pitch = writes(result.pitch);
  result.writes_roll = writes(result.roll);
}

}  // namespace

LaserLevelFit::LaserLevelFit(const RobotDescription& robot)
    : robot_(robot),
      lens_(robot.depth->intrinsics),
      T_optical_base_(robot.depth->T_base_optical.inverse().isometry()) {}

bool LaserLevelFit::ends_in_view(const LevelBeam& beam, const render::DepthPixels& image) const {
  constexpr double kLow = 0.1, kHigh = 1.2, kStep = 0.1;  // m
  const Eigen::Vector2d end = beam.origin + beam.range * beam.direction;
  for (double z = kLow; z < kHigh; z += kStep) {
    if (!std::isnan(before_surface({end.x(), end.y(), z}, image, lens_, T_optical_base_))) return true;
  }
  return false;
}

void LaserLevelFit::add_scan(const PlacedScan& placed, const render::DepthPixels& image,
                             const Pose2& T_map_image) {
  const Scan& scan = *placed.scan;
  const Eigen::Isometry3d T_base_laser = robot_.laser->T_base_laser.isometry();
  const Pose2 T_image_base = T_map_image.inverse() * placed.T_map_base;
  const Pose2 T_image_laser =
      T_image_base * Pose2{T_base_laser.translation().x(), T_base_laser.translation().y(), 0};
  std::vector<LevelBeam> in_view;
  for (std::size_t i = 2; i + 2 < scan.ranges.size(); ++i) {
    if (robot_.laser->convention.classify(scan.ranges[i]) != BeamKind::hit || is_beside_edge(scan, i))
      continue;
    const double angle = scan.angle(i), range = double{scan.ranges[i]};
    const Eigen::Vector3d ray =
        T_base_laser.linear() * Eigen::Vector3d(range * std::cos(angle), range * std::sin(angle), 0);
    const double bearing = std::atan2(ray.y(), ray.x()), yaw = bearing + T_image_base.yaw;
    const double along = ray.head<2>().norm();
    if (!(along > 0 && along < kLongest)) continue;
    const LevelBeam beam{
        T_image_laser.position(), {std::cos(yaw), std::sin(yaw)}, along, bearing, ray.z() / along};
    if (ends_in_view(beam, image)) in_view.push_back(beam);
  }
  const std::size_t stride = 1 + in_view.size() / kBeamsOfAScan;
  for (std::size_t i = 0; i < in_view.size(); i += stride) beams_.push_back({in_view[i], images_.size()});
}

void LaserLevelFit::add(render::DepthPixels image, const Pose2& T_map_base,
                        const std::vector<PlacedScan>& scans) {
  DepthCameraDescription& camera = robot_.depth.value();
  const bool other =
      !images_.empty() && (image.width != images_.front().width || image.height != images_.front().height);
  const auto intrinsics = render::intrinsics_for_size(camera.intrinsics, image.width, image.height);
  if (other || !intrinsics) {
    ++left_out_;
    return;
  }
  camera.intrinsics = *intrinsics;
  lens_ = render::Lens(*intrinsics);
  for (std::uint16_t& pixel : image.millimetres) {
    const double z = 1e-3 * static_cast<double>(pixel);
    if (z < camera.range_min || (camera.range_max > 0 && z > camera.range_max)) pixel = 0;
  }
  const std::size_t before = beams_.size();
  for (const PlacedScan& scan : scans) add_scan(scan, image, T_map_base);
  if (beams_.size() == before) return;
  images_.push_back(std::move(image));
  T_map_images_.push_back(T_map_base);
}

/// The floor tells the camera's height and tilt better than a description.
void LaserLevelFit::level_camera(LaserLevel& result) {
  const Eigen::Isometry3d described = robot_.depth->T_base_optical.isometry();
  const auto levelled = level_by_floor(images_, lens_, described);
  if (!levelled) return;
  T_optical_base_ = levelled->inverse();
  const Eigen::Matrix3d turned = levelled->linear() * described.linear().transpose();
  result.camera = Level{levelled->translation().z() - described.translation().z(), std::asin(-turned(2, 0)),
                        std::atan2(turned(2, 1), turned(2, 2))};
}

LevelPosterior LaserLevelFit::evidence(const std::function<void(double, double)>& progress) const {
  LevelPosterior posterior;
  Places places;
  std::size_t done = 0;
  for (const auto& [beam, image] : beams_) {
    if (progress && done++ % 100 == 0)
      progress(static_cast<double>(done), static_cast<double>(beams_.size()));
    const BeamPlane plane(beam, images_[image], lens_, T_optical_base_);
    std::vector<std::uint8_t> place_of;
    for (const double s : plane.columns()) {
      const Eigen::Vector2d at = beam.origin + s * beam.direction;
      place_of.push_back(places.at((T_map_images_[image] * Pose2{at.x(), at.y(), 0}).position()));
    }
    // A slope is known to half a step.
    const double pixel = std::max(plane.depth_of_end(), 0.0) / robot_.depth->intrinsics.fy;
    const double edge = std::hypot(kEdgePixels * pixel, kEdgeHeight,
                                   BeamOutcomes::slope_step() / std::sqrt(12.0) * beam.range);
    BeamOutcomes outcomes(beam.bearing, place_of.back());
    for (std::size_t t = 0; t < BeamOutcomes::kSlopes; ++t) {
      BeamOutcomes::OfHeights of_heights;
      for (std::size_t h = 0; h < BeamOutcomes::kHeights; ++h)
        of_heights[h] = plane.outcome(BeamOutcomes::height(h), BeamOutcomes::slope(t), place_of);
      outcomes.set(t, of_heights, edge);
    }
    posterior.add(outcomes);
  }
  return posterior;
}

Result<LaserLevel> LaserLevelFit::fit(const std::function<void(double, double)>& progress) {
  LaserLevel result;
  result.images = images_.size();
  result.beams = beams_.size();
  if (images_.size() < kMinImages || beams_.size() < kMinBeams)
    return Error{std::to_string(beams_.size()) + " beams end in view of the depth camera, in " +
                 std::to_string(images_.size()) + " images; " + std::to_string(kMinBeams) + " in " +
                 std::to_string(kMinImages) + " are needed"};
  level_camera(result);
  const LevelEstimate estimate = evidence(progress).estimate();
  result.agreeing = estimate.agreeing;
  result.things = estimate.things;
  if (result.agreeing < kAgreeing) {
    char text[200];
    std::snprintf(text, sizeof text,
                  "images of the depth camera contradict %.0f %% of the beams at any height and tilt: is the "
                  "camera where the description has it, and on the clock of the scans?",
                  100 * (1 - result.agreeing));
    return Error{text};
  }
  set_shown(estimate, *robot_.laser, result);
  if (!result.camera)
    result.advice.emplace_back(
        "height and tilt of the laser are not shown: the depth camera sees no floor within 4 m, from which "
        "its "
        "own height and tilt would be known");
  else if (!result.height.shown)
    result.advice.emplace_back(
        "the height of the laser is not shown: few edges lie near it; drive past tables, boxes and shelves "
        "that the depth camera sees");
  if (result.camera && (!result.pitch.shown || !result.roll.shown))
    result.advice.emplace_back(
        "the tilt of the laser is not shown: drive towards and along things of about its height, near and "
        "far, ahead and at both sides");
  return result;
}

double below_floor(const Scan& scan, const LaserDescription& laser) {
  std::size_t hits = 0, below = 0;
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    if (laser.convention.classify(scan.ranges[i]) != BeamKind::hit) continue;
    const double angle = scan.angle(i), range = double{scan.ranges[i]};
    const Eigen::Vector3d p =
        laser.T_base_laser.isometry() * Eigen::Vector3d(range * std::cos(angle), range * std::sin(angle), 0);
    ++hits;
    below += p.z() < 0 ? 1 : 0;
  }
  return hits == 0 ? 0 : static_cast<double>(below) / static_cast<double>(hits);
}

RobotDescription with_level(RobotDescription robot, const LaserLevel& level) {
  if (!level.height.shown && !level.writes_pitch && !level.writes_roll) return robot;
  Eigen::Isometry3d T_base_laser = robot.laser->T_base_laser.isometry();
  if (level.height.shown) T_base_laser.translation().z() = level.height.value;
  const double yaw = robot.laser->T_base_laser.yaw();
  T_base_laser.linear() =
      tilted(level.writes_pitch ? level.pitch.value : 0, level.writes_roll ? level.roll.value : 0) *
      T_base_laser.linear();
  const double turned = Transform<Base, Laser>(T_base_laser).yaw();
  T_base_laser.linear() =
      Eigen::AngleAxisd(wrap_angle(yaw - turned), Eigen::Vector3d::UnitZ()) * T_base_laser.linear();
  robot.laser->T_base_laser = Transform<Base, Laser>(T_base_laser);
  return robot;
}

}  // namespace parhelion::tools
