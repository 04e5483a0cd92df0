// Real returns that the model of the building does not explain (people, moved furniture), as discs in the
// map.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "fusion/scan/ray_caster.hpp"
#include "fusion/scan/sweep_rays.hpp"
#include "protocols/scan.hpp"

namespace parhelion::scan {

/// The visible part of one obstacle, or of a piece of a long one. Valid for the instant of the scan only: the
/// obstacle may move.
struct UnexplainedDisc {
  Eigen::Vector2d center;  ///< m, map frame
  double radius = 0;       ///< m, contains all its returns
  std::size_t returns = 0;
};

struct UnexplainedOptions {
  double margin = 0.3;        ///< m, minimum distance in front of the modelled wall on the beam
  double clearance = 0.3;     ///< m, from any modelled surface around that bearing
  double sigmas = 3;          ///< added to both: this number of standard deviations of a return
  double gap = 0.25;          ///< m, between neighbouring returns of one obstacle
  double max_diameter = 1.0;  ///< m; a longer one becomes several discs
  double min_radius = 0.1;    ///< m; a laser sees only the near side
  std::size_t min_returns = 2;
  double floor_margin = 0.05;  ///< m over the map's floor (z = 0): lower returns of downward beams are floor
  double floor_slope = 0.01;   ///< m more per metre of range: the attitude is not exact
};

/// Memory is reused from scan to scan: nothing is allocated after warm-up.
class UnexplainedReturns {
 public:
  explicit UnexplainedReturns(const UnexplainedOptions& options = {}) : options_(options) {}

  /// `time` as in BeamSet; `building_hits` from cast_building over the same beams, one per beam (where it is
  /// shorter than the scan, the remaining beams are ignored); `sigma`: m, 1 sigma of a return's position in
  /// the map (pose and model), to which the laser's own noise is added. Valid until the next call.
  std::span<const UnexplainedDisc> find(const Scan& real, const LaserDescription& laser,
                                        const LaserMotion& motion, std::span<const float> time,
                                        std::span<const RangeHit> building_hits, double sigma);

 private:
  bool clear_of_model(std::size_t i, double range, std::span<const RangeHit> building_hits, double clearance,
                      double angle_increment) const;
  void close_cluster();

  UnexplainedOptions options_;
  SweepRays rays_;
  std::vector<char> unexplained_;         // per beam
  std::vector<Eigen::Vector2d> cluster_;  // returns of the current obstacle, in the order of the beams
  std::vector<UnexplainedDisc> discs_;
};

}  // namespace parhelion::scan
