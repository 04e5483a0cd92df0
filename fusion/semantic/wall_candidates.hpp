// Walls that may be, with the openings in them. Internal to the semantic net.
#pragma once

#include <vector>

#include "fusion/semantic/levels.hpp"
#include "fusion/semantic/segmentation.hpp"
#include "fusion/semantic/semantic_net.hpp"
#include "fusion/semantic/wall_raster.hpp"

namespace parhelion::semantic {

/// A stretch of a wall's plane that is not measured in the plane itself.
struct Opening {
  std::size_t wall = 0;       ///< into the candidates
  double from = 0, to = 0;    ///< m along the wall
  double sill = 0, head = 0;  ///< m, heights of its lower and upper edge
  double recess = 0;          ///< m behind the wall's plane, of what closes it; 0: nothing does
  double closed = 0;          ///< share that something behind closes
  bool seen_through = false;
  double empty = 0;                         ///< share of the rays that should have met something and did not
  double sill_floor = 0;                    ///< share of its width along which the floor goes on through it
  double lintel = 0;                        ///< share of the plane above it that is measured
  double door_score = 0, window_score = 0;  ///< logarithms, against "a gap"

  double width() const { return to - from; }
};

/// Collinear vertical surfaces as one.
struct WallCandidate {
  std::vector<std::uint32_t> surfaces;  ///< vertical surfaces that it is made of
  Eigen::Vector2d start = Eigen::Vector2d::Zero(), end = Eigen::Vector2d::Zero();  ///< m
  double z_low = 0, z_high = 0, thickness = 0;
  double floor = 0, ceiling = 0;  ///< m, the levels that it stands between
  double visible_from = 0;        ///< m, the height over what stands along it
  double coverage = 0;            ///< share of its plane that is measured, openings left out
  double upper_coverage = 0;      ///< the same above 1.8 m from the floor
  double open = 0;         ///< share of what is known of it that a scanner looked through; doors left out
  double observed = 0;     ///< share that is measured or seen through
  bool one_sided = false;  ///< floor was measured on one side of it at most
  WallRaster raster;
  double score = 0;                ///< logarithm, as a wall against something unknown
  std::uint32_t curve = no_curve;  ///< of the round wall that it is a facet of
  double round_length = 0;         ///< m, of all of that

  double length() const { return (end - start).norm(); }
  /// Of the wall that a person would speak of.
  double whole_length() const { return curve == no_curve ? length() : round_length; }
  double yaw() const { return std::atan2(end.y() - start.y(), end.x() - start.x()); }
};

/// Whether two openings are one hole, seen in the two faces of a wall.
bool same_hole(const Opening& a, const WallCandidate& wall_a, const Opening& b, const WallCandidate& wall_b);

/// Two candidates for one wall: parallel, and within each other's thickness for most of the shorter.
bool same_place(const WallCandidate& a, const WallCandidate& b);

struct WallCandidates {
  std::vector<WallCandidate> walls;
  std::vector<Opening> openings;
};

/// Openings of one wall whose raster is filled: runs of columns that are not measured, and leaves that lie a
/// little behind the wall's face.
std::vector<Opening> find_openings(const PlanPoints& points, const WallCandidate& wall, std::size_t index,
                                   const SemanticNetOptions& options);

WallCandidates find_wall_candidates(const PlanPoints& points, const Segmentation& segmentation,
                                    const Levels& levels, const SemanticNetOptions& options);

}  // namespace parhelion::semantic
