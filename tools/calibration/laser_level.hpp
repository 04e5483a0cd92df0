// Height and tilt of a planar laser, by depth images of the same robot: where a beam ends, an image shows a
// surface, and it shows none that the beam would have passed through. Walls show nothing of the height. Edges
// of furniture and the floor do.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "fusion/pose/calibration/motion_calibration.hpp"
#include "protocols/robot.hpp"
#include "protocols/scan.hpp"
#include "tools/calibration/beam_plane.hpp"
#include "tools/calibration/level_posterior.hpp"

namespace parhelion::tools {

struct LaserLevel {
  pose::Measured height;       ///< m, of the laser above the floor, z in base_link
  pose::Measured pitch, roll;  ///< rad, by which the described laser is turned about the base's y and x axes
  /// Whether the description gets them: known so well that no beam seems to end at the floor, and 2 sigma
  /// from what is described.
  bool writes_pitch = false, writes_roll = false;
  double agreeing = 0;  ///< fraction of the beams that end where images show a surface
  std::size_t images = 0, beams = 0;
  std::size_t things = 0;  ///< places of the map, 0.75 m wide, that contradict a height or tilt
  /// By how much the depth camera is higher (m) and turned more (rad) than described, by the floor that it
  /// sees; nullopt: it sees none, and neither height nor tilt is shown.
  std::optional<Level> camera;
  std::vector<std::string> advice;  ///< which drive would show what this one does not
};

/// A scan from about the time of an image, taken at once.
struct PlacedScan {
  const Scan* scan = nullptr;
  Pose2 T_map_base;
};

class LaserLevelFit {
 public:
  /// The robot has a laser, and a depth camera that is fixed to its base.
  explicit LaserLevelFit(const RobotDescription& robot);

  /// The camera's lens is scaled to the size of the first image. Images of another size or aspect are left
  /// out. Pixels beyond the camera's ranges count as not measured. What moves between an image and a scan
  /// counts as an outlier.
  void add(render::DepthPixels image, const Pose2& T_map_base, const std::vector<PlacedScan>& scans);
  std::size_t left_out() const { return left_out_; }  ///< images, by their size

  /// Error: too few beams end in view of the camera, or images contradict the scans. Deterministic. Of what
  /// is not shown the value is that of the description.
  Result<LaserLevel> fit(const std::function<void(double done, double total)>& progress = {});

 private:
  struct Beam {
    LevelBeam beam;  ///< in the frame of the base at the image
    std::size_t image;
  };
  bool ends_in_view(const LevelBeam& beam, const render::DepthPixels& image) const;
  void add_scan(const PlacedScan& placed, const render::DepthPixels& image, const Pose2& T_map_image);
  void level_camera(LaserLevel& result);
  LevelPosterior evidence(const std::function<void(double, double)>& progress) const;

  RobotDescription robot_;
  render::Lens lens_;
  Eigen::Isometry3d T_optical_base_;
  std::vector<render::DepthPixels> images_;
  std::vector<Pose2> T_map_images_;
  std::vector<Beam> beams_;
  std::size_t left_out_ = 0;
};

/// Fraction of the hits of a scan that lie below the floor.
double below_floor(const Scan& scan, const LaserDescription& laser);

/// The description with the height that was shown and the tilt that is to be written. x, y and yaw stay.
RobotDescription with_level(RobotDescription robot, const LaserLevel& level);

}  // namespace parhelion::tools
