// A cloud as small pieces of surface: per cube of space the moments of its points, and from those of the cube
// and its 26 neighbours a mean and a normal (a normal distributions map, Biber and Strasser 2003; Magnusson
// 2009). Each surfel covers about the same area, whatever its distance to the scanner.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/cloud/voxel_index.hpp"

namespace parhelion::cloud {

/// Columns of equal length.
struct Surfels {
  double size = 0;                       ///< m, side of the cubes
  std::vector<Eigen::Vector3f> means;    ///< m, of the cube's own points
  std::vector<Eigen::Vector3f> normals;  ///< unit; towards the scanner where its position is known
  std::vector<float> slack;  ///< variance along the normal relative to that within the surface: about 0 for
                             ///< flat, 1 for not flat
  std::vector<float> thickness;  ///< m, 1 sigma of the points along the normal; negative: too few points
  bool oriented = false;         ///< normals point towards the scanner

  std::size_t count() const { return means.size(); }
  /// m, median thickness of the flat surfels; 0 where there is none.
  double noise() const;
};

/// Moments from which surfels of several sizes are computed.
class VoxelMoments {
 public:
  /// Points are finite; size > 0, enlarged where more than 2^21 cubes would lie along an axis. `scans` and
  /// `viewpoints` as in PointCloud; without viewpoints, normals are not oriented.
  VoxelMoments(std::span<const Eigen::Vector3f> points, double size,
               std::span<const std::uint16_t> scans = {}, std::span<const Eigen::Vector3d> viewpoints = {});

  /// The moments for cubes of twice the side.
  VoxelMoments coarser() const;

  double size() const { return size_; }
  std::size_t count() const { return cells_.size(); }

  /// The result is the same for any number of threads (0: all).
  Surfels surfels(int threads = 1) const;

 private:
  /// Count, sums of x y z (m) and of xx yy zz xy xz yz (m^2) about the origin, which all sizes share, so that
  /// the moments of cubes can be added. Double: its rounding error is below that of the points' floats.
  using Moments = Eigen::Array<double, 10, 1>;
  struct Cell {
    Moments moments = Moments::Zero();
    Eigen::Vector3i index;
    std::uint32_t viewpoint = 0;  ///< of the first point
  };

  VoxelMoments() = default;
  Cell& cell_at(const Eigen::Vector3i& index, std::uint32_t viewpoint);
  Moments with_neighbours(const Cell& cell) const;
  void make_surfel(std::size_t i, Surfels& surfels) const;

  double size_ = 0;
  Eigen::Vector3f origin_ = Eigen::Vector3f::Zero();
  std::vector<Cell> cells_;
  std::vector<Eigen::Vector3f> viewpoints_;
  VoxelIndex index_;  ///< into cells_, in the order of the first point: identical on each run
};

}  // namespace parhelion::cloud
