// Which beams of a sweep can meet a sphere: a conservative answer in a few operations, so that only those are
// cast.
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

/// Ascending, apart from each other. More than one where the sphere lies across the ends of a full turn.
struct BeamRanges {
  std::array<BeamRange, 4> range;
  int count = 0;
  void add(BeamRange r);
  const BeamRange* begin() const { return range.data(); }
  const BeamRange* end() const { return range.data() + count; }
};

/// Bearings from first to last beam, how the laser turns during the sweep, and how far it sees.
class BeamWindow {
 public:
  /// `half_turn`, `half_tilt`: rad, bounds on how far the laser's frame and its plane turn from where it is
  /// half-way.
  BeamWindow(const BeamSet& beams, double half_turn, double half_tilt, double max_range);

  /// Whether no beam comes near: `height` over the laser's plane half-way, m, of a centre that all of a shape
  /// lies within `reach` of, as far as height goes.
  bool misses_plane(double height, double reach) const { return std::abs(height) - reach > plane_slack_; }

  /// Beams that can meet a sphere with its centre in the frame that the laser has half-way through the sweep.
  /// The radius includes how far the centre moves, seen from the laser, either way from where it is half-way.
  BeamRanges meet(const Eigen::Vector3d& center, double radius) const;

 private:
  BeamRanges all() const;
  BeamRanges about(double bearing, double width) const;

  double angle_first_;
  double beams_per_radian_, beams_per_turn_;  ///< infinite where the beams cannot be told by their bearing
  std::size_t beams_;
  double turns_per_beam_;
  double half_tilt_, max_range_;
  double plane_slack_;  ///< m, how far off the middle plane the farthest point of a beam can be
  double sin_turn_, cos_turn_;
};

}  // namespace parhelion::scan
