// Folders of depth images with camera poses (7-Scenes, TUM) as 3D scans.
#include <Eigen/Eigenvalues>

#include "fusion/cloud/sensor_cloud.hpp"
#include "tools/import/image_files.hpp"
#include "tools/import/rgbd_folder.hpp"
#include "tools/map/scan_sources.hpp"

namespace parhelion::tools {
namespace {

/// Estimates up from the camera poses: hand-held cameras roll little and pitch more, so that x axes are
/// nearly level and view axes less so. The direction most perpendicular to both, on the side of the images'
/// top.
Eigen::Vector3d up_of(const std::vector<RgbdPose>& poses) {
  constexpr double roll = 5, pitch = 30;  // degrees, standard deviations
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d top = Eigen::Vector3d::Zero();
  for (const RgbdPose& pose : poses) {
    const Eigen::Matrix3d R = pose.T_world_depth.linear();
    sum +=
        R.col(0) * R.col(0).transpose() / (roll * roll) + R.col(2) * R.col(2).transpose() / (pitch * pitch);
    top -= R.col(1);
  }
  const Eigen::Vector3d up = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(sum).eigenvectors().col(0);
  return up.dot(top) < 0 ? Eigen::Vector3d(-up) : up;
}

/// The rotation to a frame whose z axis points up: from the folder's gravity, else estimated roughly from the
/// cameras.
Eigen::Matrix3d level_axes(const RgbdFolder& folder, const std::string& name,
                           std::vector<std::string>& notes) {
  if (!folder.down)
    notes.push_back(name + ": no gravity-direction.txt beside the frames: up is estimated from the cameras");
  const Eigen::Vector3d up = folder.down ? Eigen::Vector3d(-*folder.down) : up_of(folder.poses);
  return Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

}  // namespace

Status open_rgbd_scans(const std::filesystem::path& path, const ScanSourceOptions& options,
                       std::optional<Eigen::Matrix3d>& R_level_world, OpenedScans& opened) {
  ImportOptions import;
  import.input = path;
  const auto folder = read_rgbd_folder(import);
  if (!folder) return folder.error();
  for (const Refusal& refusal : folder->refused) {
    opened.notes.push_back(path.string() + ": " + refusal.place + ": " + refusal.why);
  }
  if (!R_level_world) R_level_world = level_axes(*folder, path.string(), opened.notes);
  Eigen::Isometry3d T_level_world = Eigen::Isometry3d::Identity();
  T_level_world.linear() = *R_level_world;
  std::optional<Eigen::Isometry3d> last;
  const std::size_t before = opened.scans.size();
  for (const RgbdFile& frame : folder->depth) {
    const auto T_world_depth = pose_at(folder->poses, frame.stamp);
    if (!T_world_depth || (last && !moved_enough(*last, *T_world_depth, options))) continue;
    const auto bytes = read_file(frame.path.string());
    if (!bytes) return bytes.error();
    const auto depth = read_depth_png(*bytes, folder->depth_units_per_metre);
    if (!depth) return Error{frame.path.string() + ": " + depth.error().message};
    const auto cloud =
        cloud::cloud_from_depth(depth->mm, folder->cameras.depth, {.step = options.pixel_step});
    if (!cloud) return Error{frame.path.string() + ": " + cloud.error().message};
    if (cloud->empty()) continue;
    const Transform<Cloud, DepthOptical> T_level_optical(T_level_world * *T_world_depth);
    opened.scans.push_back({frame.path.string(),
                            cloud::turned_level(*cloud, T_level_optical),
                            {Eigen::Quaterniond::Identity(), T_level_optical.translation()},
                            true});
    last = T_world_depth;
  }
  if (opened.scans.size() > before) return {};
  return Error{path.string() + ": none of its " + std::to_string(folder->depth.size()) +
               " depth images has a pose (a .pose.txt, or two lines of groundtruth.txt at most 0.1 s apart)"};
}

}  // namespace parhelion::tools
