// How far a real door is open: its leaf's angle, fitted to the returns of one scan.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "fusion/scan/ray_caster.hpp"
#include "fusion/scan/sweep_rays.hpp"
#include "protocols/door.hpp"
#include "protocols/scan.hpp"

namespace parhelion::scan {

/// What one scan says of one leaf.
struct LeafSight {
  std::optional<double> angle;  ///< rad, of the hinge; none: too few beams fall on it, or they fit no leaf
  bool gone = false;            ///< beams pass where it was known to be
  std::size_t returns = 0;      ///< that lie on it
};

/// A wall, pillar or window near a door: a return on it is not the leaf's, which may lie in one plane with
/// it.
struct WallBeside {
  Transform<Body, Map> T_wall_map;
  Eigen::Vector3d half;  ///< m
};
/// Those of a model that are within the leaf's reach.
std::vector<WallBeside> walls_beside(const ModelEntity& door, const Hinge& hinge, const SemanticModel& model);

struct LeafFitOptions {
  std::size_t min_returns = 6;
  double min_share = 0.8;    ///< of the beams that a leaf there would stop, those that it did stop
  double min_extent = 0.45;  ///< of the leaf's length, that its returns span: a person's are fewer
  double margin = 0.03;      ///< m across the leaf, and...
  double sigmas = 2;         ///< ...so many standard deviations of a return...
  double most_margin = 0.1;  ///< m, ...up to here
  double jamb = 0.1;         ///< m from the axis: nearer are frame and wall
  double in_wall = 0.08;     ///< m: a return this near a wall is the wall's
  double apart = 0.17;       ///< rad: two fits so far apart are two leaves, and then nobody knows
};

/// One-dimensional: each return votes for the angle at which it stands about the hinge (a Hough transform,
/// Duda and Hart 1972), and what has most votes is fitted by least squares and judged by all beams, those
/// that pass through it too. Upright leaves only. Memory is kept from scan to scan.
class LeafFit {
 public:
  explicit LeafFit(const LeafFitOptions& options = {}) : options_(options) {}

  /// The scan that the next calls are about; `real`, `laser` and what `time` refers to stay until then.
  /// `time` as in BeamSet; `sigma`: m, 1 sigma of where a return lies in the map (pose and model), to which
  /// the laser's own noise is added.
  void set_scan(const Scan& real, const LaserDescription& laser, const LaserMotion& motion,
                std::span<const float> time, double sigma);
  /// `known`: rad, the hinge's angle as it was last seen, if it was.
  LeafSight find(const ModelEntity& door, const Hinge& hinge, std::optional<double> known,
                 std::span<const WallBeside> walls = {});

 private:
  /// A beam in the drawn leaf's plane, from the hinge's axis.
  struct Beam {
    Eigen::Vector2d origin, direction;  ///< m; m for each metre of range
    double range = 0;                   ///< m; infinite: no return
    double origin_z = 0, direction_z = 0;
    bool of_wall = false;  ///< what it returned from
  };
  /// The leaf from its axis: along it from x0 to x1, across it about y, in height about its middle.
  struct Leaf {
    double x0, x1, y, half_thickness, half_height, lower, upper;
    double length() const { return std::max(std::abs(x0), std::abs(x1)); }
  };
  struct Judged {
    std::size_t on = 0, through = 0;
    double first = 0, last = 0;             ///< m along the leaf, of those on it
    double moment = 0, moment_squared = 0;  ///< sums of arm times offset, and of squared arms
  };

  void gather(const Transform<Map, Body>& T_map_leaf, const Eigen::Vector2d& axis, const Leaf& leaf,
              std::span<const WallBeside> walls);
  bool on_wall(const Eigen::Vector3d& p_map, std::span<const WallBeside> walls) const;
  void vote(const Leaf& leaf);
  Judged judge(const Leaf& leaf, double angle, double margin) const;
  std::optional<double> refine(const Leaf& leaf, double angle, Judged& judged) const;

  LeafFitOptions options_;
  SweepRays rays_;
  const Scan* real_ = nullptr;
  const LaserDescription* laser_ = nullptr;
  BeamSet beams_;
  double margin_ = 0;
  std::vector<Beam> near_;
  std::array<int, 360> votes_{};
};

}  // namespace parhelion::scan
