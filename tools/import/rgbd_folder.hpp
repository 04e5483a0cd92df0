// Reads folders of colour and depth frames with camera poses.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "protocols/image.hpp"
#include "protocols/status.hpp"
#include "protocols/time.hpp"
#include "tools/import/import.hpp"

namespace parhelion::tools {

struct RgbdFile {
  SensorTime stamp;
  std::filesystem::path path;
  std::uint64_t number = 0;  ///< frame, or line of the list
};

struct RgbdPose {
  SensorTime stamp;
  Eigen::Isometry3d T_world_depth;  ///< pose of the depth camera (optical) in the folder's world frame
  std::uint64_t number = 0;
};

struct RgbdCameras {
  CameraIntrinsics colour, depth;
  Eigen::Isometry3d T_depth_colour =
      Eigen::Isometry3d::Identity();  ///< colour camera in the depth camera (both optical)
  std::string source;                 ///< source files, or the assumption made
};

struct RgbdFolder {
  enum class Layout { seven_scenes, tum };
  Layout layout = Layout::seven_scenes;
  std::vector<RgbdFile> colour, depth;  ///< by stamp
  std::vector<RgbdPose> poses;          ///< by stamp
  RgbdCameras cameras;
  double depth_units_per_metre = 1000;
  std::optional<Eigen::Vector3d> down;  ///< unit vector in the world frame, if the folder contains it
  std::vector<Refusal> refused;         ///< complete, but not usable
  std::vector<Refusal> damaged;         ///< poses and lines of lists that are cut off or cannot be read
  std::vector<std::string> notes;
};

/// 7-Scenes: frame-NNNNNN.color.*, .depth.png, .pose.txt (camera to world, 4x4, of the depth camera); stamps
/// are number / options.frame_rate after 2000-01-01. TUM: rgb.txt, depth.txt, groundtruth.txt; depth is
/// registered to colour, 5000 a metre, world z up. Beside either, or one folder up: camera-intrinsics.txt
/// (3x3, depth), kapture_sensors.txt and kapture_rigs.txt, gravity-direction.txt.
Result<RgbdFolder> read_rgbd_folder(const ImportOptions& options);

/// Pose at `stamp`: exact, or interpolated between two poses at most 0.1 s apart; nullopt: none.
std::optional<Eigen::Isometry3d> pose_at(const std::vector<RgbdPose>& poses, SensorTime stamp);

/// Calibration for images of these sizes (columns, rows), from the files beside the frames.
Result<RgbdCameras> read_rgbd_cameras(const std::filesystem::path& folder, RgbdFolder::Layout layout,
                                      Eigen::Vector2i colour_size, Eigen::Vector2i depth_size,
                                      std::vector<std::string>& notes);

/// Path of `name` in `folder` or its parent; empty: in neither.
std::filesystem::path find_beside(const std::filesystem::path& folder, const char* name);

/// All numbers of a text file; '#' starts a comment. The error contains file:line and the invalid word.
Result<std::vector<double>> read_numbers(const std::filesystem::path& path);

}  // namespace parhelion::tools
