// Wall candidates and their openings. Internal to the semantic net.
#pragma once

#include <optional>
#include <vector>

#include "fusion/semantic/net/levels.hpp"
#include "fusion/semantic/net/semantic_net.hpp"
#include "fusion/semantic/net/wall_raster.hpp"
#include "fusion/semantic/segmentation/segmentation.hpp"

namespace parhelion::semantic {

/// A stretch of a wall that has no measurements in the wall's plane.
struct Opening {
  std::size_t wall = 0;       ///< into the candidates
  double from = 0, to = 0;    ///< m along the wall
  double sill = 0, head = 0;  ///< m, heights of its lower and upper edge
  double recess = 0;          ///< m, distance behind the wall's plane of the surface that closes it; 0: open
  double closed = 0;          ///< fraction closed by something behind
  bool seen_through = false;
  bool walked_through = false;  ///< without viewpoints: no lintel, and floor before and behind it
  double empty = 0;             ///< fraction of the rays expected to hit something that did not
  double sill_floor = 0;        ///< fraction of its width along which the floor continues through it
  double lintel = 0;            ///< fraction of the plane above it that is measured
  double beside_lintel =
      0;                ///< fraction of the plane above a door's height that is measured, at the lesser side
  bool hidden = false;  ///< something stands before it
  bool niche = false;   ///< a surface 0.4 to 0.8 m behind closes it
  double door_score = 0, window_score = 0;  ///< log odds against "a gap"

  double width() const { return to - from; }
};

/// Collinear vertical surfaces, merged.
struct WallCandidate {
  std::vector<std::uint32_t> surfaces;  ///< vertical surfaces that it consists of
  Eigen::Vector2d start = Eigen::Vector2d::Zero(), end = Eigen::Vector2d::Zero();  ///< m
  double z_low = 0, z_high = 0, thickness = 0;
  double floor = 0, ceiling = 0;  ///< m, the levels it extends between
  double visible_from = 0;        ///< m, height above which nothing in front hides it
  double judged_top = 0;          ///< m, height up to which its plane should be measured: the ceiling, or
                                  ///< its own top, of a partition and where the site ends
  double coverage = 0;            ///< fraction of its plane that is measured, without openings
  double upper_coverage = 0;      ///< the same above 1.8 m from the floor
  double open = 0;                ///< observed fraction that a scanner looked through, without doors
  double observed = 0;            ///< fraction that is measured or seen through
  bool one_sided = false;         ///< floor was measured on at most one side of it
  bool free_standing = false;     ///< a face of a thing that stands free under the ceiling
  bool of_pillar = false;         ///< as short as a pillar's face, and joins no wall
  WallRaster raster;
  double score = 0;                ///< log odds of a wall against an unknown object
  std::uint32_t curve = kNoCurve;  ///< index of the round wall that it belongs to
  double round_length = 0;         ///< m, of the whole round wall

  double length() const { return (end - start).norm(); }
  /// m, of the whole wall, round walls included.
  double whole_length() const { return curve == kNoCurve ? length() : round_length; }
  double yaw() const { return std::atan2(end.y() - start.y(), end.x() - start.x()); }
};

/// Whether two openings are the same hole, seen in the two faces of a wall.
bool same_hole(const Opening& a, const WallCandidate& wall_a, const Opening& b, const WallCandidate& wall_b);

/// Whether two candidates are the same wall: parallel, and within each other's thickness over most of the
/// shorter one.
bool same_place(const WallCandidate& a, const WallCandidate& b);

/// Where `back` is the other face of the wall whose face is `front`: m, from one to the other along
/// `front.raster.away`, and the stretch of `front` that lies before it. nullopt: they are no two faces of one
/// wall. Without viewpoints the distance may be negative, as the side that each is seen from is not known.
struct BackFace {
  double depth = 0;         ///< m
  double from = 0, to = 0;  ///< m, along `front`
};
std::optional<BackFace> back_face(const WallCandidate& front, const WallCandidate& back);

struct WallCandidates {
  std::vector<WallCandidate> walls;
  std::vector<Opening> openings;
};

/// Openings of one wall whose raster is filled: runs of unmeasured columns, and leaves a little behind the
/// wall's face.
std::vector<Opening> find_openings(const PlanPoints& points, const WallCandidate& wall, std::size_t index,
                                   const SemanticNetOptions& options);

WallCandidates find_wall_candidates(const PlanPoints& points, const Segmentation& segmentation,
                                    const Levels& levels, const SemanticNetOptions& options);

}  // namespace parhelion::semantic
