// The bucket grid of the paper (section 2.1): space is cut into equal cubes, and the neighbours of a point
// are in the 27 cubes around it. Points are sorted by bucket, so each bucket is contiguous in memory.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace parhelion::cloud {

/// Immutable after construction; may be read by any number of threads.
class BucketGrid {
 public:
  /// The range of a bucket in `order()` and `sorted()`.
  struct Range {
    std::uint32_t begin = 0, end = 0;
  };

  /// Cubes with sides of `bucket_size` metres (> 0) over the bounding box of the points; the side is enlarged
  /// where there would be more than `max_buckets`. Points are finite.
  BucketGrid(std::span<const Eigen::Vector3f> points, double bucket_size,
             std::size_t max_buckets = std::size_t{1} << 24);

  double bucket_size() const { return bucket_size_; }
  const Eigen::Vector3i& buckets() const { return buckets_; }  ///< along x, y, z
  std::size_t size() const { return order_.size(); }

  /// Points in the order of their buckets, and the index of each in the input (ascending within a bucket).
  const std::vector<Eigen::Vector3f>& sorted() const { return sorted_; }
  const std::vector<std::uint32_t>& order() const { return order_; }

  /// The bucket that contains `p`; may be outside of the grid (its neighbours may still hold points).
  Eigen::Vector3i bucket_of(const Eigen::Vector3f& p) const {
    return ((p - origin_) * inverse_size_).array().floor().cast<int>();
  }

  /// m, the corner of a bucket with the smallest coordinates.
  Eigen::Vector3f corner(const Eigen::Vector3i& bucket) const {
    return origin_ + bucket.cast<float>() * static_cast<float>(bucket_size_);
  }

  /// The contiguous range of the buckets x0 to x1 of a row, all within the grid; empty where x0 > x1.
  Range row(int x0, int x1, int y, int z) const {
    if (x0 > x1) return {};
    const std::size_t first =
        (static_cast<std::size_t>(z) * static_cast<std::size_t>(buckets_.y()) + static_cast<std::size_t>(y)) *
        static_cast<std::size_t>(buckets_.x());
    return {start_[first + static_cast<std::size_t>(x0)], start_[first + static_cast<std::size_t>(x1) + 1]};
  }

  /// Calls visit(Range) for the up to 9 ranges that cover the 27 buckets around `bucket` (neighbours in x are
  /// contiguous).
  template <class Visit>
  void for_each_run(const Eigen::Vector3i& bucket, Visit&& visit) const {
    const int x0 = std::max(bucket.x() - 1, 0), x1 = std::min(bucket.x() + 1, buckets_.x() - 1);
    if (x0 > x1) return;
    for (int z = std::max(bucket.z() - 1, 0); z <= std::min(bucket.z() + 1, buckets_.z() - 1); ++z) {
      for (int y = std::max(bucket.y() - 1, 0); y <= std::min(bucket.y() + 1, buckets_.y() - 1); ++y) {
        const Range run = row(x0, x1, y, z);
        if (run.begin < run.end) visit(run);
      }
    }
  }

 private:
  double bucket_size_;
  float inverse_size_;
  Eigen::Vector3f origin_ = Eigen::Vector3f::Zero();
  Eigen::Vector3i buckets_ = Eigen::Vector3i::Zero();
  std::vector<std::uint32_t> start_;  ///< per bucket, x fastest; one more at the end
  std::vector<Eigen::Vector3f> sorted_;
  std::vector<std::uint32_t> order_;
};

}  // namespace parhelion::cloud
