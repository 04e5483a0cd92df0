// A cloud as small pieces of surface: per cube of space the moments of the points that fell into it, and from
// those of the cube and its 26 neighbours a mean and a normal (a normal distributions map, Biber and Strasser
// 2003; Magnusson 2009). Each piece stands for about the same area, however near the scanner it was.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace parhelion {

/// Columns of equal length.
struct Surfels {
  double size = 0;                       ///< m, side of the cubes
  std::vector<Eigen::Vector3f> means;    ///< m, of the cube's own points
  std::vector<Eigen::Vector3f> normals;  ///< unit; towards the scanner where that is known
  std::vector<float> slack;   ///< variance along the normal, of that within the surface: about 0 flat, 1 not
  std::vector<float> counts;  ///< points in the cube
  std::vector<float> thickness;  ///< m, 1 sigma of the points along the normal; negative: too few to say
  bool oriented = false;         ///< normals point towards the scanner

  std::size_t count() const { return means.size(); }
  /// m, median thickness of what is flat; 0 where nothing is.
  double noise() const;
};

/// The moments from which surfels of several sizes are made.
class VoxelMoments {
 public:
  /// Points are finite; size > 0, made larger where more than 2^21 cubes would lie along an axis. `scans` and
  /// `viewpoints` as in PointCloud; without viewpoints normals are not oriented.
  VoxelMoments(std::span<const Eigen::Vector3f> points, double size,
               std::span<const std::uint16_t> scans = {}, std::span<const Eigen::Vector3d> viewpoints = {});

  /// Of cubes of twice the side.
  VoxelMoments coarser() const;

  double size() const { return size_; }
  std::size_t count() const { return cells_.size(); }
  double points() const;

  Surfels surfels() const;

  /// The cube that each point given to the constructor fell into, as an index of `surfels()`.
  const std::vector<std::uint32_t>& cell_of_point() const { return cell_of_point_; }

 private:
  struct Cell {
    Eigen::Vector3i index;
    std::uint32_t viewpoint = 0;                       ///< of the first point
    float n = 0;                                       ///< points
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();     ///< m, about the cube's centre
    Eigen::Vector3f square = Eigen::Vector3f::Zero();  ///< m^2: xx, yy, zz
    Eigen::Vector3f cross = Eigen::Vector3f::Zero();   ///< m^2: xy, xz, yz

    void add(const Cell& other, const Eigen::Vector3f& offset);
  };

  /// Open addressing; slots are given out in the order of the first point, so all is the same on each run.
  class Table {
   public:
    explicit Table(std::size_t expected);
    std::uint32_t find(std::uint64_t key) const;  ///< none_ where there is none
    std::uint32_t find_or_insert(std::uint64_t key, std::uint32_t next);
    std::size_t load() const { return used_; }

   private:
    void grow();
    std::vector<std::uint64_t> keys_;
    std::vector<std::uint32_t> slots_;
    std::size_t used_ = 0;
    int shift_;
  };

  static constexpr std::uint32_t none_ = ~std::uint32_t{0};
  VoxelMoments() : table_(16) {}
  static std::uint64_t key(const Eigen::Vector3i& index);
  Eigen::Vector3f centre(const Eigen::Vector3i& index) const {
    return (index.cast<float>().array() + 0.5f) * static_cast<float>(size_);
  }
  Cell with_neighbours(const Cell& cell) const;

  double size_ = 0;
  Eigen::Vector3f origin_ = Eigen::Vector3f::Zero();
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> cell_of_point_;
  std::vector<Eigen::Vector3f> viewpoints_;
  Table table_;
};

}  // namespace parhelion
