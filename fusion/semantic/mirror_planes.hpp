// What lies behind an upright plane, and whether it is the image of what lies before it. Internal to the
// search for mirrors.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "fusion/semantic/occupied_cubes.hpp"
#include "fusion/semantic/segmentation/segmentation.hpp"

namespace parhelion::semantic {

constexpr double kMirrorCube = 0.06;    ///< m, side of the cubes that are compared
constexpr double kNearestImage = 0.25;  ///< m, behind the plane: frames and reveals are nearer
constexpr double kFarthestImage = 15;   ///< m, behind the plane and along it

/// The cube of a place; those that are too far from `origin` to be marked share the outermost cubes.
Eigen::Array3i mirror_cube(const Eigen::Vector3d& p, const Eigen::Vector3d& origin);

/// A point of something that is not level.
struct SitePoint {
  Eigen::Vector3d p;
  std::uint32_t surface = kNoSurface;
  std::int32_t viewpoint = -1;
};

/// A sample of a site's points.
struct SampledSite {
  OccupiedCubes cubes;
  std::vector<SitePoint> things, samples;  ///< of what is not level; of all
  const Segmentation& segmentation;
  const std::vector<Eigen::Vector3d>& viewpoints;
  bool rays = false;                                 ///< viewpoints of the points are known
  double shared = 1;                                 ///< fraction of things in cubes with other points
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< m, of the cubes: georeferenced sites are far from 0
};

/// A plane of which one side may be the image of the other.
struct MirrorPlane {
  Eigen::Vector2d at, behind;

  Eigen::Vector2d along() const { return {-behind.y(), behind.x()}; }
  double depth_of(const Eigen::Vector3d& p) const { return behind.dot(p.head<2>() - at); }
  Eigen::Vector3d image_of(const Eigen::Vector3d& p, double shift = 0) const {
    Eigen::Vector3d image = p;
    image.head<2>() -= 2 * (depth_of(p) - shift) * behind;
    return image;
  }
  MirrorPlane moved(double by, double turn) const {
    const Eigen::Vector2d turned(std::cos(turn) * behind.x() - std::sin(turn) * behind.y(),
                                 std::sin(turn) * behind.x() + std::cos(turn) * behind.y());
    return {at + by * behind, turned};
  }
};

/// Layers behind the plane, in depth, with enough things, and those of them that are alike before it.
struct ImageLayers {
  int all = 0, alike = 0;
};

/// The points looked at are chosen by a hash of their index, and are not in the cubes, so that these tell how
/// often a surface's other points share a cube with it: seldom where points are sparse. Keeps references to
/// the arguments.
SampledSite sampled_site(const cloud::PointCloud<Map>& cloud, const Segmentation& segmentation);

/// Things behind the plane, up to 15 m away and 15 m beside `middle`, but no walls across it; every
/// `stride`th.
std::vector<const SitePoint*> things_behind(const SampledSite& site, const MirrorPlane& plane,
                                            const Eigen::Vector2d& middle, std::size_t stride);

/// Whether its image, about the plane moved by `shift` (m), lies in a cube with points.
bool has_image(const SampledSite& site, const MirrorPlane& plane, const SitePoint& thing, double shift = 0);

/// Of the things that would be alike if the plane were a mirror.
double fraction_alike(const SampledSite& site, const MirrorPlane& plane,
                      const std::vector<const SitePoint*>& things, double shift = 0);

/// The nearby plane about which the two sides are most alike, within 8 cm and half a degree.
MirrorPlane fitted(const SampledSite& site, const MirrorPlane& plane,
                   const std::vector<const SitePoint*>& things);

ImageLayers image_layers(const SampledSite& site, const MirrorPlane& plane,
                         const std::vector<const SitePoint*>& things);

/// Where the ray that measured a thing crosses the plane; nullopt: nowhere, or no ray is known.
std::optional<Eigen::Vector3d> crossing(const SampledSite& site, const MirrorPlane& plane,
                                        const SitePoint& thing);

/// Whether the plane was measured at a place of it.
bool measured_at(const SampledSite& site, const MirrorPlane& plane, const Eigen::Vector3d& p);

/// Fraction of the plane that was measured, in a rectangle: m along the plane, and heights.
double measured_in(const SampledSite& site, const MirrorPlane& plane, double from, double to, double low,
                   double high);

}  // namespace parhelion::semantic
