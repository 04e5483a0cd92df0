// Segments a level cloud into straight vertical surfaces, horizontal surfaces, and sets of parallel
// equidistant edges. The paper calls them prerequisites (section 2.2): evidence, not labels yet.
//
// The image-based pipeline: projection to OXY and OXZ, threshold, filter (equation 3), dilation, thinning,
// probabilistic Hough, each in tiles without seams.
//
// Implemented in segment.cpp, segment_normals.cpp and fusion/semantic/level.cpp.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "protocols/frames.hpp"
#include "protocols/status.hpp"

namespace parhelion::semantic {

constexpr std::uint32_t kNoSurface = 0xFFFFFFFF;
constexpr std::uint32_t kNoCurve = 0xFFFFFFFF;

/// A vertical surface over a line segment of the plan: prerequisite of a wall, a door, a railing, a riser. A
/// round surface is a chain of facets; each begins where the previous one ends.
struct VerticalSurface {
  Eigen::Vector2d start = Eigen::Vector2d::Zero();  ///< m, map frame
  Eigen::Vector2d end = Eigen::Vector2d::Zero();
  double z_low = 0, z_high = 0;  ///< m, of the points near it (1 and 99 percent)
  double thickness = 0;          ///< m, 2 sigma of the distances to its plane
  std::uint32_t points = 0;
  std::uint32_t curve = kNoCurve;  ///< number of the round surface that it belongs to
};

/// A horizontal surface: prerequisite of floor, ceiling, table top, tread.
struct HorizontalSurface {
  double z = 0;          ///< m, median of its points without outliers
  double thickness = 0;  ///< m, 2 sigma
  double area = 0;       ///< m^2, of the plan cells that it covers
  double slope = 0;  ///< m per metre, of the plane through its cells: level in each, it may rise as a whole
  Eigen::Vector2d low = Eigen::Vector2d::Zero();  ///< m, bounds in the plan
  Eigen::Vector2d high = Eigen::Vector2d::Zero();
  bool faces_down = false;  ///< seen from below, like a ceiling
  std::uint32_t points = 0;
};

/// Parallel segments at equal distances: prerequisite of stairs.
struct ParallelSet {
  std::vector<std::uint32_t> members;                    ///< into `verticals`, in order along `direction`
  Eigen::Vector2d direction = Eigen::Vector2d::UnitX();  ///< unit, across the segments, upwards
  double spacing = 0;                                    ///< m, median
};

struct SegmentationOptions {
  double pixel = 10.0 / 512;  ///< m; 10 m over 512 pixels, the paper's setting
  double near = 0.05;         ///< m, a point this near a plane belongs to it
  double min_length = 0.4;    ///< m, of a segment
  std::uint64_t seed = 1;     ///< of the probabilistic Hough transform and of random planes
  int threads = 0;            ///< 0: all; the result is the same for any number
  std::string stages;         ///< a folder for pictures of every stage; empty: none
};

struct Segmentation {
  std::vector<VerticalSurface> verticals;
  std::vector<HorizontalSurface> horizontals;
  std::vector<ParallelSet> parallels;
  /// Per point of the cloud: index of the surface that it lies on; verticals first, then horizontals
  /// (verticals.size() + i), or kNoSurface.
  std::vector<std::uint32_t> surface_of;
};

/// Errors: an empty cloud, no extent, options out of range, a stages folder that cannot be written.
Result<Segmentation> segment(const cloud::PointCloud<Map>& cloud, const SegmentationOptions& options = {});

/// The normal-based pipeline: normals (the cloud's own, or algorithm 2's) classify points as level or
/// upright; touching cubes of one plane form a surface. Uses the options near, min_length, seed, threads;
/// finds no parallel sets. Slower than the image-based pipeline of `segment`; each serves to check the other.
/// Errors: as `segment`.
Result<Segmentation> segment_by_normals(const cloud::PointCloud<Map>& cloud,
                                        const SegmentationOptions& options = {});

/// Whether a cloud has the up direction that it is read with.
struct UpDoubt {
  bool refused = false;  ///< it seems to be upside down
  std::string
      note;  ///< for the user: why it may be upside down or lie on its side; empty: nothing shows that
};

/// The rotation that levels the cloud, from its horizontal surfaces or from `up_hint` (unit, cloud frame: an
/// accelerometer's reading). Rotates by the shortest arc about the middle of the level surfaces, so that
/// heights there are unchanged. Errors: nothing horizontal within 40 degrees of the hint (or of z), with what
/// was seen; a cloud that seems to be upside down (more points below its ceiling than above its floor),
/// unless the hint is to be trusted; `doubt` (may be null) distinguishes that error from others.
Result<Transform<Map, Cloud>> level(const cloud::PointCloud<Cloud>& cloud,
                                    const Eigen::Vector3d& up_hint = Eigen::Vector3d::UnitZ(),
                                    bool trust_hint = false, UpDoubt* doubt = nullptr);

}  // namespace parhelion::semantic
