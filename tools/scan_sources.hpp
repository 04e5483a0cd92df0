// 3D scans from wherever they are: files of points, folders of them, folders of depth images with poses, LCM
// logs with DEPTH images or with the scan lines of a laser that is swept over the site (LINES, or a SCAN that
// does not lie level).
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
  cloud::ReadOptions read;      ///< of files of points
  std::filesystem::path robot;  ///< robot description instead of the log's own
  int pixel_step = 2;           ///< every n-th pixel of every n-th row of a depth image
  /// A depth image becomes a scan where the camera has moved or turned this much since the last that did.
  double frame_distance = 0.10;                     ///< m
  double frame_angle = 5 * std::numbers::pi / 180;  ///< rad
  double line_distance = 4;  ///< m that the robot drives while scan lines go to one 3D scan
  std::string
      tilt_joint;  ///< joint of JOINT_STATE that turns the laser of SCAN about its y axis; empty: none
};

struct OpenedScans {
  std::vector<cloud::ScanToRegister> scans;  ///< in the order of the sources, then of time or name
  std::vector<std::string> notes;            ///< for people, with the file
  /// Where the first scan is in the cloud that is to come: of a log in the map of its poses, else at its
  /// origin.
  Transform<Cloud, Scanner> T_cloud_first;
};

/// Opens every source. A guess is where a scan lies in the source's own world until place_guesses() was
/// called. Scans of depth images and of scan lines have level axes (z against gravity, as the poses have it)
/// and their origin at the sensor. Errors name the source and what was expected.
Result<OpenedScans> open_scans(const std::vector<std::string>& sources, const ScanSourceOptions& options,
                               const std::function<void(std::size_t, std::size_t)>& progress = {});

/// Guesses relative to the first scan.
void place_guesses(std::vector<cloud::ScanToRegister>& scans);

// One for each kind of source; they add to `opened`.
Status open_rgbd_scans(const std::filesystem::path& folder, const ScanSourceOptions& options,
                       std::optional<Eigen::Matrix3d>& R_level_world, OpenedScans& opened);
Status open_log_scans(const std::filesystem::path& log, const ScanSourceOptions& options,
                      OpenedScans& opened);

/// True where the sensor has moved enough since `last` for another scan.
bool moved_enough(const Eigen::Isometry3d& last, const Eigen::Isometry3d& now,
                  const ScanSourceOptions& options);

}  // namespace parhelion::tools
