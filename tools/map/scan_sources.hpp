// Reads 3D scans from all supported sources: files of points, folders of them, folders of depth images with
// poses, LCM logs with DEPTH images or with the scan lines of a laser that is swept over the site (LINES, or
// a SCAN that is not level).
#pragma once

#include <filesystem>
#include <functional>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "fusion/cloud/read_cloud.hpp"
#include "fusion/cloud/registration.hpp"
#include "protocols/status.hpp"

namespace parhelion::tools {

struct ScanSourceOptions {
  cloud::ReadOptions read;      ///< for files of points
  std::filesystem::path robot;  ///< robot description that replaces the log's own
  int pixel_step = 2;           ///< every n-th pixel of every n-th row of a depth image
  /// A depth image becomes a scan after the camera has moved or turned this much since the last scan.
  double frame_distance = 0.10;                     ///< m
  double frame_angle = 5 * std::numbers::pi / 180;  ///< rad
  double line_distance = 4;  ///< m that the robot drives for one 3D scan made of scan lines
  std::string
      tilt_joint;  ///< joint of JOINT_STATE that turns the laser of SCAN about its y axis; empty: none
};

struct OpenedScans {
  std::vector<cloud::ScanToRegister> scans;  ///< in the order of the sources, then of time or name
  std::vector<std::string> notes;            ///< for people, with the file name
  /// Pose of the first scan in the registered cloud: from a log in the map of its poses, else at the origin.
  Transform<Cloud, Scanner> T_cloud_first;
};

/// Opens all sources. Until place_guesses() is called, a guess is a scan's pose in the world frame of its
/// source. Scans of depth images and of scan lines have level axes (z against gravity, from the poses) and
/// their origin at the sensor. The error contains the source and what was expected.
Result<OpenedScans> open_scans(const std::vector<std::string>& sources, const ScanSourceOptions& options,
                               const std::function<void(std::size_t, std::size_t)>& progress = {});

/// Makes the guesses relative to the first scan.
void place_guesses(std::vector<cloud::ScanToRegister>& scans);

// One function for each kind of source; they append to `opened`.
Status open_rgbd_scans(const std::filesystem::path& folder, const ScanSourceOptions& options,
                       std::optional<Eigen::Matrix3d>& R_level_world, OpenedScans& opened);
Status open_log_scans(const std::filesystem::path& log, const ScanSourceOptions& options,
                      OpenedScans& opened);

/// True if the sensor has moved enough since `last` for another scan.
bool moved_enough(const Eigen::Isometry3d& last, const Eigen::Isometry3d& now,
                  const ScanSourceOptions& options);

}  // namespace parhelion::tools
