// A tree of boxes over points, eight to a leaf and eight to each box above, for exact closest points of whole
// groups of queries at once: what a group is near to is looked up once, and each of its points tells those
// leaves apart by itself. Eight boxes or points are looked at in one by AVX2 where the processor has it; the
// portable twin gives the same answer.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/cloud/nearest_point.hpp"

namespace parhelion::cloud {

/// The order that puts points into a tree's leaves: halved along the longest side until `leaf` are left.
std::vector<std::uint32_t> tree_order(std::span<const Eigen::Vector3f> points, std::size_t leaf, int threads);

/// Immutable after it was built; may be read by any number of threads.
class PointTree {
 public:
  static constexpr std::size_t lanes = 8;  ///< points of a leaf, boxes of a box

  /// Points are finite, at least one. `portable`: without AVX2.
  PointTree(std::span<const Eigen::Vector3f> points, int threads, bool portable);

  /// In the tree's order: points, and for each its index in those that were given.
  Eigen::Vector3f point(std::size_t i) const { return {x_[i], y_[i], z_[i]}; }
  const std::vector<std::uint32_t>& order() const { return order_; }

  /// Eight boxes by columns: low x y z, high x y z.
  struct alignas(32) Boxes {
    float side[6][lanes];
  };
  /// Leaves with their boxes; the last eight are filled up by boxes that are near nothing.
  struct Leaves {
    std::vector<Boxes> boxes;
    std::vector<std::uint32_t> first;  ///< of each leaf's points
    std::size_t count = 0;
  };

  /// All leaves within sqrt(distance2) metres of the box, in their order; `near` is cleared first.
  void leaves_near(const Eigen::AlignedBox3f& box, float distance2, Leaves& near) const;

  struct Query {
    Eigen::Vector3f p;
    float distance2;  ///< m^2, how far to look
    bool second;      ///< whether the second nearest within that distance is of interest
    NearestPoint found;
  };
  /// The nearest point to each p of those in `near`, the lowest index (of the tree's order) among equally
  /// near ones; -1: none within distance. `second2` is at most the second nearest's, and less where that is
  /// further than was looked.
  void nearest(const Leaves& near, std::span<Query> queries) const;

  /// Some point that is about the nearest.
  std::uint32_t about_nearest(const Eigen::Vector3f& p) const;

 private:
  void make_boxes();
  void add_leaves(std::uint32_t eight, unsigned mask, Leaves& near) const;
  unsigned hits(const Boxes& boxes, const Eigen::AlignedBox3f& box, float distance2) const;
  void nearest_portable(const Leaves& near, Query& query) const;
  void nearest_avx2(const Leaves& near, std::span<Query> queries) const;

  bool avx2_;
  std::vector<std::uint32_t> order_;
  std::vector<float> x_, y_, z_;            ///< padded to whole leaves by far points
  std::vector<std::vector<Boxes>> levels_;  ///< of the leaves, then of eight boxes each, one at the end
};

}  // namespace parhelion::cloud
