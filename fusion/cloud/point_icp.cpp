#include "fusion/cloud/point_icp.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

#include "fusion/cloud/nearest_point.hpp"
#include "fusion/cloud/parallel.hpp"

namespace parhelion::cloud {
namespace {

constexpr std::size_t kChunk = 64;  // groups
                                    // a step is mostly shorter than the one before

double longest_side(std::span<const Eigen::Vector3f> points) {
  Eigen::AlignedBox3f bounds;
  for (const Eigen::Vector3f& p : points) bounds.extend(p);
  return std::max(1e-6, static_cast<double>(bounds.sizes().maxCoeff()));
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
    : options_(options), source_order_(tree_order(source, kGroup, options.threads)) {
  assert(!target.empty() && !source.empty() && options.max_distance > 0);
  const double side = longest_side(target);
  rounding_ = 1e-5f * static_cast<float>(side);
  if (options.paper_grid) {
    // The paper's cube of 2 x 2 x 2 in 28 x 28 x 28; slightly larger, so that the far side is inside.
    grid_.emplace(target, side * (1 + 1e-6) / 28);
    constexpr std::size_t padding = 8;
    for (const Eigen::Vector3f& p : grid_->sorted()) {
      x_.push_back(p.x());
      y_.push_back(p.y());
      z_.push_back(p.z());
    }
    for (auto* column : {&x_, &y_, &z_}) column->resize(grid_->size() + padding, 1e18f);
  } else {
    tree_.emplace(target, options.threads, options.portable);
  }
  groups_.resize((source.size() + kGroup - 1) / kGroup);
  for (std::size_t i = 0; i < groups_.size() * kGroup; ++i) {
    const Eigen::Vector3f& p = source[source_order_[std::min(i, source.size() - 1)]];
    Group& group = groups_[i / kGroup];
    const auto lane = static_cast<Eigen::Index>(i % kGroup);
    group.x[lane] = p.x(), group.y[lane] = p.y(), group.z[lane] = p.z();
    group.partner[i % kGroup] = -1;
    group.clearance[lane] = -1;
    group.count = std::min(kGroup, source.size() - i / kGroup * kGroup);
  }
}

Eigen::Vector3f PointIcp::target(std::int32_t i) const {
  const auto at = static_cast<std::size_t>(i);
  return grid_ ? grid_->sorted()[at] : tree_->point(at);
}

/// Searches shells of buckets around p, nearest first, until everything outside of them is further than the
/// second nearest or than `reach`.
NearestPoint PointIcp::search_grid(const Eigen::Vector3f& p, float reach) const {
  const auto nearest = options_.portable || !have_avx2() ? nearest_point_portable : nearest_point_avx2;
  NearestPoint found;
  const auto size = static_cast<float>(grid_->bucket_size());
  const Eigen::Vector3i centre = grid_->bucket_of(p);
  const Eigen::Vector3i& buckets = grid_->buckets();
  for (int shell = 0;; ++shell) {
    const auto look = [&](int y, int z, int x0, int x1) {
      if (y < 0 || z < 0 || y >= buckets.y() || z >= buckets.z()) return;
      const BucketGrid::Range run = grid_->row(std::max(x0, 0), std::min(x1, buckets.x() - 1), y, z);
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
    // p is within its bucket: from there to outside of the shells it is at least this far, less a margin for
    // rounding.
    const Eigen::Vector3f low = grid_->corner(centre), high = low.array() + size;
    const float margin = std::min((p - low).minCoeff(), (high - p).minCoeff());
    const float seen =
        std::max(0.0f, (static_cast<float>(shell) + std::min(margin / size, 1.0f)) * size - 1e-4f * size);
    if (found.d2 <= seen * seen || seen >= reach) {
      found.second2 = std::min(found.second2, seen * seen);
      return found;
    }
  }
}

struct PointIcp::Sum {
  PairMoments moments;
  std::size_t searched = 0;
  Sum& operator+=(const Sum& other) {
    moments += other.moments;
    searched += other.searched;
    return *this;
  }
};

/// Scratch memory of a thread for one group.
struct PointIcp::Room {
  Sixteen x, y, z, bound2, move;  ///< target frame; m^2 to the last partner; m since the last step
  std::array<PointTree::Query, kGroup> queries;
  std::array<std::uint8_t, kGroup> lane;  ///< of each query
  std::size_t searching = 0;
  PointTree::Leaves near;
};

void PointIcp::search_tree(Group& group, Room& room) const {
  const auto reach = static_cast<float>(options_.max_distance);
  const std::span<PointTree::Query> queries = std::span(room.queries).first(room.searching);
  Eigen::AlignedBox3f box;
  for (const PointTree::Query& query : queries) box.extend(query.p);
  float furthest2 = 0;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    PointTree::Query& query = queries[i];
    const auto lane = static_cast<Eigen::Index>(room.lane[i]);
    // Steps get shorter: points within two of them may soon be nearer. Only useful when steps are short.
    const float bound = std::sqrt(room.bound2[lane]), two_steps = 2 * room.move[lane];
    query.second = two_steps < 0.05f * bound;
    const float radius = query.second ? bound + two_steps : bound;
    query.distance2 = std::max(radius * radius, room.bound2[lane]);
    furthest2 = std::max(furthest2, query.distance2);
  }
  tree_->leaves_near(box, furthest2, room.near);
  tree_->nearest(room.near, queries);
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const NearestPoint& found = queries[i].found;
    const std::size_t lane = room.lane[i];
    const bool is_near = found.index >= 0 && found.d2 <= reach * reach;
    group.partner[lane] = is_near ? found.index : -1;
    group.clearance[static_cast<Eigen::Index>(lane)] =
        std::sqrt(is_near ? found.second2 : std::min(found.d2, queries[i].distance2));
  }
}

void PointIcp::step_group(Group& group, const Motion& motion, Room& room, Sum& sum) const {
  const auto moved = [&](const Eigen::Isometry3f& T, int row) -> Sixteen {
    return T(row, 0) * group.x + T(row, 1) * group.y + (T(row, 2) * group.z + T(row, 3));
  };
  const auto reach = static_cast<float>(options_.max_distance);
  room.x = moved(motion.T, 0), room.y = moved(motion.T, 1), room.z = moved(motion.T, 2);
  room.move =
      (moved(motion.change, 0).square() + moved(motion.change, 1).square() + moved(motion.change, 2).square())
          .sqrt();
  const Sixteen clearance = group.clearance - room.move - rounding_;
  const bool first = group.clearance[0] < 0;
  const std::uint32_t seed = first && tree_ ? tree_->about_nearest({room.x[0], room.y[0], room.z[0]}) : 0;
  room.searching = 0;
  for (std::size_t i = 0; i < group.count; ++i) {
    const auto lane = static_cast<Eigen::Index>(i);
    const Eigen::Vector3f p(room.x[lane], room.y[lane], room.z[lane]);
    const std::int32_t partner = first && tree_ ? static_cast<std::int32_t>(seed) : group.partner[i];
    const float d2 = partner >= 0 ? distance2(target(partner), p) : reach * reach;
    room.bound2[lane] = std::min(d2, reach * reach);
    const float certain = std::max(clearance[lane], 0.0f);
    group.clearance[lane] = certain;
    if (!first && (group.partner[i] >= 0 ? d2 < certain * certain && d2 <= reach * reach : certain > reach))
      continue;
    room.queries[room.searching].p = p;
    room.lane[room.searching++] = static_cast<std::uint8_t>(i);
  }
  sum.searched += room.searching;
  if (tree_ && room.searching > 0) {
    if (first) room.move.setZero();
    search_tree(group, room);
  } else if (grid_) {
    for (std::size_t i = 0; i < room.searching; ++i) {
      const auto lane = static_cast<Eigen::Index>(room.lane[i]);
      const NearestPoint found =
          search_grid(room.queries[i].p, std::min(reach, 1.000001f * std::sqrt(room.bound2[lane])));
      const bool is_near = found.index >= 0 && found.d2 <= reach * reach;
      group.partner[room.lane[i]] = is_near ? found.index : -1;
      group.clearance[lane] = std::sqrt(is_near || found.index < 0 ? found.second2 : found.d2);
    }
  }
  add_pairs(group, room, sum);
}

void PointIcp::add_pairs(const Group& group, const Room& room, Sum& sum) const {
  // [b; 1] [a; 1]^T contains every moment.
  Eigen::Matrix4d outer = Eigen::Matrix4d::Zero();
  double squares = 0;
  for (std::size_t i = 0; i < group.count; ++i) {
    if (group.partner[i] < 0) continue;
    const auto lane = static_cast<Eigen::Index>(i);
    const Eigen::Vector3f near = target(group.partner[i]);
    const Eigen::Vector4d a(group.x[lane], group.y[lane], group.z[lane], 1),
        b(near.x(), near.y(), near.z(), 1);
    outer += b * a.transpose();
    squares += distance2(near, {room.x[lane], room.y[lane], room.z[lane]});
  }
  sum.moments.n += outer(3, 3);
  sum.moments.a += outer.row(3).head<3>().transpose();
  sum.moments.b += outer.col(3).head<3>();
  sum.moments.ba += outer.topLeftCorner<3, 3>();
  sum.moments.squares += squares;
}

Eigen::Isometry3d PointIcp::step(const Eigen::Isometry3d& T_target_source) {
  Motion motion{T_target_source.cast<float>(), {}};
  motion.change.matrix() = motion.T.matrix() - last_T_.matrix();
  const Sum sum =
      sum_over_chunks<Sum>(groups_.size(), kChunk, options_.threads, [&](std::size_t begin, std::size_t end) {
        Sum part;
        Room room;
        for (std::size_t i = begin; i < end; ++i) step_group(groups_[i], motion, room, part);
        return part;
      });
  moments_ = sum.moments;
  searched_ = sum.searched;
  last_T_ = motion.T;
  return moments_.n >= 3 ? closest_motion(moments_) : T_target_source;
}

std::vector<std::int32_t> PointIcp::partners() const {
  std::vector<std::int32_t> result(source_order_.size(), -1);
  const std::vector<std::uint32_t>& order = grid_ ? grid_->order() : tree_->order();
  for (std::size_t i = 0; i < result.size(); ++i) {
    const std::int32_t partner = groups_[i / kGroup].partner[i % kGroup];
    if (partner >= 0)
      result[source_order_[i]] = static_cast<std::int32_t>(order[static_cast<std::size_t>(partner)]);
  }
  return result;
}

}  // namespace parhelion::cloud
