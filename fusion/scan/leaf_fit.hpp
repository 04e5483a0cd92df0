// Estimates the opening angle of a real door by fitting its leaf to the returns of one scan.
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

/// Result for one leaf from one scan.
struct LeafFitResult {
  std::optional<double> angle;  ///< rad, of the hinge; none: too few beams meet it, or they fit no leaf
  bool gone = false;            ///< beams pass through its last known position
  std::size_t returns = 0;      ///< that lie on the leaf
};

/// A wall, pillar or window near a door: a return on it does not count for the leaf, which may lie in the
/// same plane.
struct WallBeside {
  Transform<Body, Map> T_wall_map;
  Eigen::Vector3d half;  ///< m
};
/// The entities of a model within the leaf's reach.
std::vector<WallBeside> walls_beside(const ModelEntity& door, const Hinge& hinge, const SemanticModel& model);

struct LeafFitOptions {
  std::size_t min_returns = 6;
  double min_fraction = 0.8;  ///< minimum fraction of the beams at the leaf that end on it
  double min_extent = 0.45;   ///< minimum fraction of the leaf's length with returns; a person covers less
  double margin = 0.03;       ///< m across the leaf
  double sigmas = 2;          ///< standard deviations of a return, added to `margin`...
  double max_margin = 0.1;    ///< m, ...up to this limit
  double jamb = 0.1;          ///< m from the axis: nearer returns belong to frame and wall
  double in_wall = 0.08;      ///< m: a return this near a wall belongs to the wall
  double apart = 0.17;        ///< rad: two fits this far apart are ambiguous, and no angle is reported
};

/// One-dimensional: each return votes for its angle about the hinge (a Hough transform, Duda and Hart 1972);
/// the best angle is refined by least squares and checked against all beams, including those that pass
/// through it. Upright leaves only. Memory is reused from scan to scan.
class LeafFit {
 public:
  explicit LeafFit(const LeafFitOptions& options = {}) : options_(options) {}

  /// Sets the scan for the next calls; `real`, `laser` and the span of `time` must stay valid until then.
  /// `time` as in BeamSet; `sigma`: m, 1 sigma of a return's position in the map (pose and model), to which
  /// the laser's own noise is added.
  void set_scan(const Scan& real, const LaserDescription& laser, const LaserMotion& motion,
                std::span<const float> time, double sigma);
  /// `known`: rad, the last known hinge angle, if any.
  LeafFitResult find(const ModelEntity& door, const Hinge& hinge, std::optional<double> known,
                     std::span<const WallBeside> walls = {});

 private:
  /// A beam in the drawn leaf's plane, from the hinge's axis.
  struct Beam {
    Eigen::Vector2d origin, direction;  ///< m; m per metre of range
    double range = 0;                   ///< m; infinite: no return
    double origin_z = 0, direction_z = 0;
    bool of_wall = false;  ///< whether it returned from a wall
  };
  /// The leaf relative to its axis: from x0 to x1 along it, centred at y across it, in height about its
  /// middle.
  struct Leaf {
    double x0, x1, y, half_thickness, half_height, lower, upper;
    double length() const { return std::max(std::abs(x0), std::abs(x1)); }
  };
  struct Judged {
    std::size_t on = 0, through = 0;
    double first = 0, last = 0;             ///< m along the leaf, of the returns on it
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
