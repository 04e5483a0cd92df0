#include "tools/import/rgbd_placement.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "protocols/angle_units.hpp"
#include "tools/import/image_files.hpp"
#include "tools/import/rgbd_floor.hpp"
#include "tools/import/rgbd_registration.hpp"

namespace parhelion::tools {
namespace {

constexpr std::size_t kFramesForTheFloor = 40;

struct DepthSurvey {
  SurfacePoints surfaces;
  DepthRegistration registration;
  std::uint16_t nearest = 0, farthest = 0;  ///< mm
};

/// The colour image of the same instant, if colour and depth are separate cameras.
void add_colour(const RgbdFolder& folder, const RgbdFile& frame, const DepthMillimetres& depth,
                DepthRegistration& registration) {
  if (folder.cameras.T_depth_colour.isApprox(Eigen::Isometry3d::Identity())) return;
  const auto same = std::find_if(folder.colour.begin(), folder.colour.end(),
                                 [&](const RgbdFile& file) { return file.stamp == frame.stamp; });
  if (same == folder.colour.end()) return;
  const auto file = read_file(same->path.string());
  if (!file) return;
  const auto grey = read_grey(*file);
  if (grey) registration.add(depth, folder.cameras.depth, *grey);
}

/// Refines the registration by edges, because stated calibrations do not always match the images.
void register_colour(const DepthSurvey& survey, RgbdPlacement& placement, const RgbdCameras& cameras,
                     std::vector<std::string>& notes) {
  constexpr double clearly_better = 1.05;
  placement.T_depth_colour = cameras.T_depth_colour;
  const Eigen::Isometry3d stated = cameras.T_depth_colour.inverse();
  const double before = survey.registration.score(cameras.colour, stated);
  if (before <= 0) return;
  const Eigen::Isometry3d refined = survey.registration.refine(cameras.colour, stated);
  const double after = survey.registration.score(cameras.colour, refined);
  if (after < clearly_better * before) return;
  placement.T_depth_colour = refined.inverse();
  const Eigen::AngleAxisd turned(Eigen::Matrix3d(refined.linear() * stated.linear().transpose()));
  const Eigen::Quaterniond q(stated.linear());
  char text[320];
  std::snprintf(text, sizeof text,
                "colour turned by %.2f degrees against depth from what the calibration states (quaternion "
                "wxyz %.6f %.6f "
                "%.6f %.6f): depth edges then lie on colour gradients of %.0f on average, before %.0f",
                turned.angle() / kRadiansPerDegree, q.w(), q.x(), q.y(), q.z(), after, before);
  notes.push_back(text);
}

DepthSurvey survey_depth(const RgbdFolder& folder) {
  DepthSurvey survey;
  const std::size_t step = std::max<std::size_t>(1, folder.depth.size() / kFramesForTheFloor);
  for (std::size_t i = 0; i < folder.depth.size(); i += step) {
    const auto pose = pose_at(folder.poses, folder.depth[i].stamp);
    const auto file = read_file(folder.depth[i].path.string());
    if (!pose || !file) continue;
    const auto depth = read_depth_png(*file, folder.depth_units_per_metre);
    if (!depth) continue;
    survey.surfaces.add(*depth, folder.cameras.depth, *pose);
    add_colour(folder, folder.depth[i], *depth, survey.registration);
    for (const std::uint16_t mm : depth->mm) {
      if (mm == 0) continue;
      survey.nearest = survey.nearest == 0 ? mm : std::min(survey.nearest, mm);
      survey.farthest = std::max(survey.farthest, mm);
    }
  }
  return survey;
}

/// Up in the world frame: from the folder, else from surfaces near the cameras' own up direction.
Result<Eigen::Vector3d> find_up(const RgbdFolder& folder, const DepthSurvey& survey,
                                std::vector<std::string>& notes) {
  if (folder.down) return Eigen::Vector3d(-*folder.down);
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const RgbdPose& pose : folder.poses) up -= pose.T_world_depth.linear().col(1);
  const auto refined = survey.surfaces.refine_up(up);
  if (!refined) {
    return Error{
        "the upward direction cannot be determined: too few level surfaces; put gravity-direction.txt (a "
        "vector that points down) beside the frames"};
  }
  notes.push_back("no gravity-direction.txt: the level surfaces give the upward direction");
  return *refined;
}

/// z up, floor at 0, origin under the first camera, x its heading.
Eigen::Isometry3d map_from_world(const Eigen::Vector3d& up, double floor,
                                 const Eigen::Isometry3d& T_world_first) {
  Eigen::Vector3d ahead = T_world_first.linear().col(2);
  ahead = (ahead - ahead.dot(up) * up).normalized();
  Eigen::Matrix3d R_map_world;
  R_map_world.row(0) = ahead.transpose();
  R_map_world.row(1) = up.cross(ahead).transpose();
  R_map_world.row(2) = up.transpose();
  Eigen::Isometry3d T_map_world = Eigen::Isometry3d::Identity();
  T_map_world.linear() = R_map_world;
  const Eigen::Vector3d origin = R_map_world * T_world_first.translation();
  T_map_world.translation() = Eigen::Vector3d(-origin.x(), -origin.y(), -floor);
  return T_map_world;
}

/// base_link is fixed to the camera: on the floor under it, and level at the mean of all poses.
void place_base(const RgbdFolder& folder, RgbdPlacement& placement, std::vector<std::string>& notes) {
  double height = 0;
  Eigen::Vector4d mean = Eigen::Vector4d::Zero();
  for (const RgbdPose& pose : folder.poses) {
    const auto T_map_optical = placement.map_optical(pose.T_world_depth);
    height += T_map_optical.translation().z();
    const Eigen::Vector3d ahead = T_map_optical.rotation().col(2);
    const Eigen::AngleAxisd level(-std::atan2(ahead.y(), ahead.x()), Eigen::Vector3d::UnitZ());
    const Eigen::Quaterniond q(level * T_map_optical.rotation());
    mean += (mean.dot(q.coeffs()) < 0 ? -1.0 : 1.0) * q.coeffs();
  }
  placement.camera_height = height / static_cast<double>(folder.poses.size());
  Eigen::Quaterniond rotation;
  rotation.coeffs() = mean.normalized();
  placement.T_base_depth = {rotation, {0, 0, placement.camera_height}};
  double tilt = 0, off_floor = 0;
  for (const RgbdPose& pose : folder.poses) {
    const auto T_map_base = placement.map_base(pose.T_world_depth);
    tilt = std::max(tilt, std::acos(std::clamp(T_map_base.rotation()(2, 2), -1.0, 1.0)));
    off_floor = std::max(off_floor, std::abs(T_map_base.translation().z()));
  }
  char text[240];
  std::snprintf(text, sizeof text,
                "the camera is hand-held: base_link is fixed to it, under it on the floor and level at the "
                "mean pose; it "
                "tilts by up to %.1f degrees and leaves the floor by up to %.2f m",
                tilt / kRadiansPerDegree, off_floor);
  notes.push_back(text);
}

}  // namespace

Result<RgbdPlacement> place_rgbd(const RgbdFolder& folder, std::vector<std::string>& notes) {
  RgbdPlacement placement;
  if (folder.poses.empty()) return Error{"no camera pose can be read; without poses there is no map"};
  const DepthSurvey survey = survey_depth(folder);
  placement.depth_min = static_cast<float>(survey.nearest) / 1000;
  placement.depth_max = static_cast<float>(survey.farthest) / 1000;
  const auto up = find_up(folder, survey, notes);
  if (!up) return up.error();
  const auto floor = survey.surfaces.find_floor(*up);
  if (!floor) return Error{"no floor found: no level layer in the depth frames"};
  placement.T_map_world = map_from_world(floor->up, floor->height, folder.poses.front().T_world_depth);
  char text[200];
  std::snprintf(
      text, sizeof text,
      "map: z up, floor (the lowest supported level layer) at 0, %.3f m under the first camera; the floor "
      "leans by %.2f degrees from the stated up direction, and the map follows the floor",
      placement.map_optical(folder.poses.front().T_world_depth).translation().z(),
      floor->leveled / kRadiansPerDegree);
  notes.push_back(text);
  place_base(folder, placement, notes);
  register_colour(survey, placement, folder.cameras, notes);
  return placement;
}

}  // namespace parhelion::tools
