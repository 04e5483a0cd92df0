#include "fusion/cloud/point_icp.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "fusion/cloud/nearest_point.hpp"
#include "fusion/cloud/parallel.hpp"

namespace parhelion {
namespace {

constexpr std::size_t chunk = 2048;

double longest_side(std::span<const Eigen::Vector3f> points) {
  Eigen::AlignedBox3f bounds;
  for (const Eigen::Vector3f& p : points) bounds.extend(p);
  return std::max(1e-6, static_cast<double>(bounds.sizes().maxCoeff()));
}

/// m; surfaces fill about the square of the grid's side in buckets, so this gives about 4 points to each.
double bucket_size(std::span<const Eigen::Vector3f> points, const PointIcpOptions& options) {
  const double side = longest_side(points);
  // The paper's cube of 2 x 2 x 2 in 28 x 28 x 28; a hair more, so that the far side is within.
  if (options.paper_grid) return side * (1 + 1e-6) / 28;
  return side / std::clamp(std::sqrt(static_cast<double>(points.size()) / 4), 4.0, 400.0);
}

}  // namespace

PairMoments& PairMoments::operator+=(const PairMoments& other) {
  n += other.n;
  a += other.a;
  b += other.b;
  ba += other.ba;
  squares += other.squares;
  return *this;
}

Eigen::Isometry3d closest_motion(const PairMoments& moments) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  if (moments.n < 3) return T;
  const Eigen::Vector3d a = moments.a / moments.n, b = moments.b / moments.n;
  const Eigen::Matrix3d covariance = moments.ba / moments.n - b * a.transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d sign = Eigen::Vector3d::Ones();
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) sign.z() = -1;
  T.linear() = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  T.translation() = b - T.linear() * a;
  return T;
}

PointIcp::PointIcp(std::span<const Eigen::Vector3f> target, std::span<const Eigen::Vector3f> source,
                   const PointIcpOptions& options)
    : options_(options), grid_(target, bucket_size(target, options)) {
  assert(!target.empty() && !source.empty() && options.max_distance > 0);
  constexpr std::size_t padding = 8;
  for (const Eigen::Vector3f& p : grid_.sorted()) {
    x_.push_back(p.x());
    y_.push_back(p.y());
    z_.push_back(p.z());
  }
  for (auto* column : {&x_, &y_, &z_}) column->resize(grid_.size() + padding, 1e18f);
  // The source by its own buckets, so that one after the other looks at the same memory.
  const BucketGrid order(source, grid_.bucket_size());
  source_order_ = order.order();
  for (const Eigen::Vector3f& p : order.sorted()) queries_.push_back({p, -1, -1});
}

/// Shells of buckets around p, nearest first, until what lies outside of them is further than the second
/// nearest or than `reach`.
NearestPoint PointIcp::search(const Eigen::Vector3f& p, const NearestPoint& known, float reach) const {
  const auto nearest = options_.portable || !have_avx2() ? nearest_point_portable : nearest_point_avx2;
  NearestPoint found = known;
  const auto size = static_cast<float>(grid_.bucket_size());
  const Eigen::Vector3i centre = grid_.bucket_of(p);
  const Eigen::Vector3i& buckets = grid_.buckets();
  for (int shell = 0;; ++shell) {
    const auto look = [&](int y, int z, int x0, int x1) {
      if (y < 0 || z < 0 || y >= buckets.y() || z >= buckets.z()) return;
      const BucketGrid::Range run = grid_.row(std::max(x0, 0), std::min(x1, buckets.x() - 1), y, z);
      if (run.begin < run.end) nearest({x_.data(), y_.data(), z_.data()}, run.begin, run.end, p, found);
    };
    for (int dz = -shell; dz <= shell; ++dz) {
      for (int dy = -shell; dy <= shell; ++dy) {
        const int y = centre.y() + dy, z = centre.z() + dz;
        if (std::max(std::abs(dy), std::abs(dz)) == shell) {
          look(y, z, centre.x() - shell, centre.x() + shell);
        } else {
          look(y, z, centre.x() - shell, centre.x() - shell);
          look(y, z, centre.x() + shell, centre.x() + shell);
        }
      }
    }
    // p is within its bucket: from there to outside of the shells it is at least this far. Rounding costs a
    // little.
    const Eigen::Vector3f low = grid_.corner(centre), high = low.array() + size;
    const float margin = std::min((p - low).minCoeff(), (high - p).minCoeff());
    const float seen =
        std::max(0.0f, (static_cast<float>(shell) + std::min(margin / size, 1.0f)) * size - 1e-4f * size);
    if (found.d2 <= seen * seen || seen >= reach) {
      found.second2 = std::min(found.second2, seen * seen);
      return found;
    }
  }
}

Eigen::Isometry3d PointIcp::step(const Eigen::Isometry3d& T) {
  const Eigen::Matrix3f R = T.linear().cast<float>(), R_last = last_T_.linear().cast<float>();
  const Eigen::Vector3f t = T.translation().cast<float>(), t_last = last_T_.translation().cast<float>();
  const auto reach = static_cast<float>(options_.max_distance);
  const float rounding = 1e-5f * (t.norm() + static_cast<float>(grid_.bucket_size()));
  struct Sum {
    PairMoments moments;
    std::size_t searched = 0;
    Sum& operator+=(const Sum& other) {
      moments += other.moments;
      searched += other.searched;
      return *this;
    }
  };
  const Sum sum =
      sum_over_chunks<Sum>(queries_.size(), chunk, options_.threads, [&](std::size_t begin, std::size_t end) {
        Sum part;
        for (std::size_t i = begin; i < end; ++i) {
          Query& query = queries_[i];
          const Eigen::Vector3f p = R * query.p + t;
          NearestPoint known;
          if (query.partner >= 0)
            known.offer(query.partner,
                        (grid_.sorted()[static_cast<std::size_t>(query.partner)] - p).squaredNorm());
          if (query.clearance >= 0) query.clearance -= (p - (R_last * query.p + t_last)).norm() + rounding;
          const float certain = std::max(query.clearance, 0.0f);
          const bool still_nearest = query.partner >= 0 ? known.d2 < certain * certain : certain > reach;
          if (!still_nearest) {
            ++part.searched;
            const NearestPoint found =
                search(p, {}, known.index >= 0 ? std::min(reach, std::sqrt(known.d2)) : reach);
            query.partner = found.index;
            query.clearance = std::sqrt(found.second2);
            known = found;
          }
          if (query.partner < 0 || known.d2 > reach * reach) continue;
          const Eigen::Vector3d a = query.p.cast<double>(),
                                b = grid_.sorted()[static_cast<std::size_t>(query.partner)].cast<double>();
          part.moments.n += 1;
          part.moments.a += a;
          part.moments.b += b;
          part.moments.ba += b * a.transpose();
          part.moments.squares += known.d2;
        }
        return part;
      });
  moments_ = sum.moments;
  searched_ = sum.searched;
  last_T_ = T;
  return moments_.n >= 3 ? closest_motion(moments_) : T;
}

std::vector<std::int32_t> PointIcp::partners() const {
  std::vector<std::int32_t> result(queries_.size(), -1);
  const Eigen::Matrix3f R = last_T_.linear().cast<float>();
  const Eigen::Vector3f t = last_T_.translation().cast<float>();
  const auto reach = static_cast<float>(options_.max_distance);
  for (std::size_t i = 0; i < queries_.size(); ++i) {
    if (queries_[i].partner < 0) continue;
    const auto j = static_cast<std::size_t>(queries_[i].partner);
    if ((grid_.sorted()[j] - (R * queries_[i].p + t)).squaredNorm() <= reach * reach)
      result[source_order_[i]] = static_cast<std::int32_t>(grid_.order()[j]);
  }
  return result;
}

}  // namespace parhelion
