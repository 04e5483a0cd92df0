// Clouds of equal spacing: voxel maps and thinned clouds. Their surfaces are steps of a voxel, and too sparse
// for pictures of 2 cm; each point is replaced by points of the plane through its neighbours.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"

namespace parhelion::semantic {

/// m, median distance of a point to its nearest neighbour where that is nearly the same everywhere (tenth and
/// ninetieth percentile within 0.55 and 1.6 of it) and at least 2.5 cm; nullopt for other clouds, whose
/// density falls with the distance to the scanner.
std::optional<double> voxel_spacing(const cloud::PointCloud<Cloud>& cloud);

/// m, 0.07, 0.10 or 0.13: the smallest side of cubes in which a sparse scan's surfaces join, else the
/// largest; nullopt for clouds whose surfaces join in cubes of 5 cm, and for clouds of more than a million
/// points.
std::optional<double> sparse_spacing(const cloud::PointCloud<Cloud>& cloud);

struct SpreadCloud {
  cloud::PointCloud<Cloud> cloud;     ///< scans and viewpoints as in the original
  std::vector<std::uint32_t> parent;  ///< per point: the original's point
  double voxel = 0;                   ///< m, of a voxel map; 0: a sparse cloud
};

/// Points in rows and columns 1.5 to 2 cm apart over each voxel's face, on every other crossing, moved onto
/// the plane through the neighbours within 2.3 voxels (least squares); a voxel where these form no plane
/// keeps an upright line of points.
SpreadCloud spread_voxels(const cloud::PointCloud<Cloud>& cloud, double spacing, int threads = 0);

/// Label of each original point: the most frequent one of its points, the lowest of equally frequent ones.
std::vector<std::uint8_t> labels_of_parents(const SpreadCloud& spread, std::span<const std::uint8_t> labels,
                                            std::size_t parents);

}  // namespace parhelion::semantic
