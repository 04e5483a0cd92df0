// Neighbouring returns of a scan that belong to one surface, with the features that tell legs and bodies from
// furniture (after Arras, Mozos, Burgard: "Using Boosted Features for the Detection of People in 2D Range
// Data", ICRA 2007).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/people/laser_sweep.hpp"
#include "fusion/people/near_places.hpp"
#include "fusion/scan/sweep_rays.hpp"

namespace parhelion::people {

/// Order of the features of a segment. All in metres unless said otherwise.
enum class SegmentFeature : std::uint8_t {
  returns,          ///< number, at most 60
  width,            ///< between its first and its last return
  depth,            ///< largest distance of a return from the line between these two, towards the laser
  roughness,        ///< RMS distance of its returns from the best line
  circle_radius,    ///< of the best circle, at most 0.5
  circle_residual,  ///< RMS distance of its returns from that circle
  range,
  spacing,            ///< between two beams at its range
  nearer_step,        ///< range beside its ends minus the range there, -1..1, the smaller; 1: no return
  farther_step,       ///< the same, the larger
  laser_height,       ///< above the map's floor
  nearest_distance,   ///< to the nearest other segment no wider than a body, at most 1.5
  nearest_width,      ///< of that segment
  second_distance,    ///< to the second nearest, at most 1.5
  neighbours,         ///< number of these within 1 m, at most 10
  straight_distance,  ///< from its centre to the nearest wider segment next to it in the scan, at most 1
  concavity,          ///< largest distance of a return behind the convex hull, as seen from the laser
  count
};
inline constexpr std::size_t kSegmentFeatures = static_cast<std::size_t>(SegmentFeature::count);
using SegmentFeatures = std::array<float, kSegmentFeatures>;

struct Segment {
  std::uint32_t first = 0, last = 0;                 ///< into SegmentedScan::returns
  Eigen::Vector2d center = Eigen::Vector2d::Zero();  ///< m, map: mean of the returns
  double width = 0;                                  ///< m
  double radius = 0;                                 ///< m: largest distance of a return from the centre
  double range = 0;                                  ///< m
  bool occluded =
      false;  ///< its first or its last return is beside something nearer: its true extent is not known
  SegmentFeatures features{};
};

struct SegmentOptions {
  double gap = 0.12;       ///< m, between neighbouring returns of one segment, at least
  double gap_beams = 2.5;  ///< the same in distances between two beams
  double max_gap = 0.3;    ///< m, at most
  double max_width = 0.9;  ///< m: a wider one is no candidate
  std::size_t min_returns = 2;
  double margin = 0.12;  ///< m in front of and beside the model: nearer returns are the building
  double sigmas = 2;     ///< added to it
  double floor_margin = 0.05;
};

struct Return {
  Eigen::Vector2d p;  ///< m, map
  double range = 0;   ///< m
  std::uint32_t beam = 0;
};

/// Memory is reused from scan to scan.
class SegmentedScan {
 public:
  explicit SegmentedScan(const SegmentOptions& options = {}) : options_(options) {}

  /// Valid until the next call: segments that may be a person's, in the order of the beams.
  std::span<const Segment> find(const LaserSweep& sweep);
  std::span<const Return> returns() const { return returns_; }

 private:
  void collect_returns(const LaserSweep& sweep);
  bool building(const LaserSweep& sweep, std::size_t beam, double range, double margin) const;
  void split(const LaserSweep& sweep);
  void close(const LaserSweep& sweep, std::size_t first, std::size_t last);
  void add_neighbours();

  SegmentOptions options_;
  scan::SweepRays rays_;
  std::vector<Return> returns_;
  std::vector<Segment> segments_;
  std::vector<Eigen::Vector2d> wide_;  ///< ends of segments that are too wide
  NearPlaces centers_;                 ///< of the segments
};

}  // namespace parhelion::people
