#include "fusion/cloud/bucket_grid.hpp"

#include <algorithm>
#include <cassert>

namespace parhelion::cloud {

BucketGrid::BucketGrid(std::span<const Eigen::Vector3f> points, double bucket_size, std::size_t max_buckets)
    : bucket_size_(bucket_size), inverse_size_(static_cast<float>(1 / bucket_size)) {
  assert(bucket_size > 0 && max_buckets > 0);
  Eigen::AlignedBox3f bounds;
  for (const Eigen::Vector3f& p : points) bounds.extend(p);
  if (points.empty()) {
    start_ = {0, 0};
    return;
  }
  origin_ = bounds.min();
  const Eigen::Vector3d extent = (bounds.max() - bounds.min()).cast<double>();
  const auto count = [&](double size) { return ((extent / size).array().floor() + 1).prod(); };
  while (count(bucket_size_) > static_cast<double>(max_buckets)) bucket_size_ *= 1.25;
  inverse_size_ = static_cast<float>(1 / bucket_size_);
  buckets_ = bucket_of(bounds.max()).array() + 1;

  // Counting sort: stable, so the input order is kept within a bucket.
  const auto index = [&](const Eigen::Vector3f& p) {
    const Eigen::Vector3i b = bucket_of(p).cwiseMin(buckets_ - Eigen::Vector3i::Ones());
    return (static_cast<std::size_t>(b.z()) * static_cast<std::size_t>(buckets_.y()) +
            static_cast<std::size_t>(b.y())) *
               static_cast<std::size_t>(buckets_.x()) +
           static_cast<std::size_t>(b.x());
  };
  const auto total = buckets_.cast<std::size_t>().prod();
  // Counts are stored two places ahead and summed to the begin of the previous bucket; filling moves each to
  // its own begin.
  start_.assign(total + 2, 0);
  for (const Eigen::Vector3f& p : points) ++start_[index(p) + 2];
  for (std::size_t i = 2; i < total + 2; ++i) start_[i] += start_[i - 1];
  sorted_.resize(points.size());
  order_.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint32_t at = start_[index(points[i]) + 1]++;
    sorted_[at] = points[i];
    order_[at] = static_cast<std::uint32_t>(i);
  }
  start_.pop_back();
}

}  // namespace parhelion::cloud
