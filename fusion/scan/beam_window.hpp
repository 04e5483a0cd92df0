// Conservative bounds of the beams of a sweep that can meet a sphere, so that only those are cast.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>

#include "fusion/scan/ray_caster.hpp"

namespace parhelion::scan {

/// Beams [first, last).
struct BeamRange {
  std::size_t first = 0, last = 0;
  bool empty() const { return first >= last; }
};

/// Ascending and disjoint. More than one where the sphere lies across the ends of a full turn.
struct BeamRanges {
  std::array<BeamRange, 4> range;
  int count = 0;
  void add(BeamRange r);
  const BeamRange* begin() const { return range.data(); }
  const BeamRange* end() const { return range.data() + count; }
};

/// Bearings from first to last beam, rotation of the laser during the sweep, and maximum range.
class BeamWindow {
 public:
  /// `half_turn`, `half_tilt`: rad, bounds on the rotation of the laser's frame and of its plane from their
  /// orientation half-way through the sweep.
  BeamWindow(const BeamSet& beams, double half_turn, double half_tilt, double max_range);

  /// Whether every beam misses a shape. `height`: m, of the shape's centre over the laser's plane half-way
  /// through the sweep; `reach`: m, bound on the shape's extent in height.
  bool misses_plane(double height, double reach) const { return std::abs(height) - reach > plane_slack_; }

  /// Beams that can meet a sphere with its centre in the laser's frame half-way through the sweep. The radius
  /// includes the motion of the centre relative to the laser during the sweep.
  BeamRanges meet(const Eigen::Vector3d& center, double radius) const;

 private:
  BeamRanges all() const;
  BeamRanges about(double bearing, double width) const;

  double angle_min_;
  double beams_per_radian_, beams_per_turn_;  ///< infinite where bearings do not distinguish the beams
  std::size_t beams_;
  double turns_per_beam_;
  double half_tilt_, max_range_;
  double plane_slack_;  ///< m, largest distance of a beam's end from the middle plane
  double sin_turn_, cos_turn_;
};

}  // namespace parhelion::scan
