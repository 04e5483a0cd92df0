// A tree of boxes over points (eight points per leaf, eight boxes per node) for exact closest points of
// groups of queries: the leaves near a group are looked up once, and each point of the group then searches
// those leaves. Eight boxes or points are processed at once with AVX2 where the processor has it; the
// portable reference gives the same result.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/cloud/nearest_point.hpp"

namespace parhelion::cloud {

/// The order of the points in a tree's leaves: split in half along the longest side until `leaf` are left.
std::vector<std::uint32_t> tree_order(std::span<const Eigen::Vector3f> points, std::size_t leaf, int threads);

/// Immutable after construction; may be read by any number of threads.
class PointTree {
 public:
  static constexpr std::size_t kLanes = 8;  ///< points per leaf, child boxes per node

  /// Points are finite, at least one. `portable`: without AVX2.
  PointTree(std::span<const Eigen::Vector3f> points, int threads, bool portable);

  /// Points in the tree's order, and the index of each in the input.
  Eigen::Vector3f point(std::size_t i) const { return {x_[i], y_[i], z_[i]}; }
  const std::vector<std::uint32_t>& order() const { return order_; }

  /// Eight boxes by columns: minimum x y z, maximum x y z.
  struct alignas(32) Boxes {
    float side[6][kLanes];
  };
  /// Leaves with their boxes; the last eight are padded with boxes at infinite distance.
  struct Leaves {
    std::vector<Boxes> boxes;
    std::vector<std::uint32_t> first;  ///< of each leaf's points
    std::size_t count = 0;
  };

  /// All leaves within sqrt(distance2) metres of the box, in their order; `near` is cleared first.
  void leaves_near(const Eigen::AlignedBox3f& box, float distance2, Leaves& near) const;

  struct Query {
    Eigen::Vector3f p;
    float distance2;  ///< m^2, search radius
    bool second;      ///< whether the second nearest within that distance is needed
    NearestPoint found;
  };
  /// The nearest point in `near` to each p (the lowest index in the tree's order among equally near ones);
  /// -1: none within the distance. `second2` is a lower bound of the squared distance to the second nearest.
  void nearest(const Leaves& near, std::span<Query> queries) const;

  /// An approximately nearest point.
  std::uint32_t about_nearest(const Eigen::Vector3f& p) const;

 private:
  void make_boxes();
  void add_leaves(std::uint32_t eight, unsigned mask, Leaves& near) const;
  unsigned hits(const Boxes& boxes, const Eigen::AlignedBox3f& box, float distance2) const;
  void nearest_portable(const Leaves& near, Query& query) const;
  void nearest_avx2(const Leaves& near, std::span<Query> queries) const;

  bool avx2_;
  std::vector<std::uint32_t> order_;
  std::vector<float> x_, y_, z_;            ///< padded to whole leaves with far points
  std::vector<std::vector<Boxes>> levels_;  ///< leaves first, then nodes of eight boxes, the root last
};

}  // namespace parhelion::cloud
