#include "fusion/cloud/partner_search.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

namespace parhelion::cloud {
namespace {

constexpr float kMinCosine = 0.5f;        // surfaces that differ by more than 60 degrees do not match
constexpr float kHopelessCosine = 0.35f;  // nor do they after a rotation by up to:
constexpr float kTurnToHope = 0.16f;      // rad; acos(0.35) - acos(0.5) is 0.166
constexpr float kRounding = 0.01f;        // of a bucket: its bounds are rounded
constexpr int kRings = 3;

/// Squared distances in buckets from a place within one to those before and after it along an axis.
struct AxisDistances {
  std::array<float, 2 * kRings + 1> squared{};

  explicit AxisDistances(float place) {
    for (int k = 1; k <= kRings; ++k) {
      const float before = place + static_cast<float>(k - 1), after = static_cast<float>(k) - place;
      squared[static_cast<std::size_t>(kRings - k)] = before * before;
      squared[static_cast<std::size_t>(kRings + k)] = after * after;
    }
  }
  float operator[](int offset) const { return squared[static_cast<std::size_t>(kRings + offset)]; }
};

/// A row of buckets next to the surfel's own.
struct RowOffset {
  int y, z;
  float distance2;  ///< buckets^2, minimum distance to any place in the own row
};
using RowOffsets = std::array<RowOffset, std::size_t{2 * kRings + 1} * (2 * kRings + 1)>;

constexpr RowOffsets make_row_offsets() {
  const auto between = [](int offset) { return std::max({offset - 1, -offset - 1, 0}); };
  RowOffsets offsets{};
  std::size_t count = 0;
  for (int z = -kRings; z <= kRings; ++z) {
    for (int y = -kRings; y <= kRings; ++y) {
      offsets[count++] = {y, z, static_cast<float>(between(y) * between(y) + between(z) * between(z))};
    }
  }
  std::sort(offsets.begin(), offsets.end(), [](const RowOffset& a, const RowOffset& b) {
    return std::tuple(a.distance2, a.y * a.y + a.z * a.z, a.z, a.y) <
           std::tuple(b.distance2, b.y * b.y + b.z * b.z, b.z, b.y);
  });
  return offsets;
}

constexpr RowOffsets kRowOffsets = make_row_offsets();

}  // namespace

SurfelTarget::SurfelTarget(const Surfels& target)
    : grid(target.means, target.size, std::max<std::size_t>(4096, 64 * target.count())) {
  surfels.size = target.size;
  surfels.oriented = target.oriented;
  surfels.means = grid.sorted();
  surfels.normals.resize(target.count());
  surfels.slack.resize(target.count());
  surfels.thickness.resize(target.count());
  for (std::size_t i = 0; i < target.count(); ++i) {
    const std::uint32_t from = grid.order()[i];
    surfels.normals[i] = target.normals[from];
    surfels.slack[i] = target.slack[from];
    surfels.thickness[i] = target.thickness[from];
  }
}

PartnerSearch::PartnerSearch(const SurfelTarget& target, const Surfels& source, double gate)
    : target_(&target),
      source_(&source),
      tracked_(source.count()),
      origin_(target.grid.corner(Eigen::Vector3i::Zero())),
      gate_(static_cast<float>(gate)),
      inverse_bucket_size_(static_cast<float>(1 / target.grid.bucket_size())),
      margin_(static_cast<float>(0.25 * target.grid.bucket_size())),
      both_oriented_(source.oriented && target.surfels.oriented) {
  assert(gate <= 2.5001 * target.grid.bucket_size());
}

void PartnerSearch::move_to(const Eigen::Isometry3d& T_target_source) {
  R_last_ = R_;
  t_last_ = t_;
  R_ = T_target_source.linear().cast<float>();
  t_ = T_target_source.translation().cast<float>();
  // The chord approximates the angle while it is small; the error of a large one does not matter.
  const double chord = (R_ - R_last_).cast<double>().norm() / std::numbers::sqrt2;
  turned_ += 1.01 * chord;
}

/// Cosine between normals, 1 where they are too uncertain.
float PartnerSearch::facing(const Query& query, std::uint32_t j) const {
  if (!query.normal_is_certain || target_->surfels.slack[j] >= kFlatEnough) return 1;
  const float cosine = query.n.dot(target_->surfels.normals[j]);
  return both_oriented_ ? cosine : std::abs(cosine);
}

void PartnerSearch::consider(Query& query, std::uint32_t j, float d2) const {
  const auto index = static_cast<std::int32_t>(j);
  const bool nearer = d2 < query.nearest2 || (d2 == query.nearest2 && index < query.found);
  if (index == query.found || (!nearer && d2 >= query.other2)) return;
  const float cosine = facing(query, j);
  if (nearer && cosine >= kMinCosine) {
    if (query.found >= 0) query.other2 = std::min(query.other2, query.nearest2);
    query.nearest2 = d2;
    query.found = index;
  } else if (cosine >= kHopelessCosine) {
    query.other2 = std::min(query.other2, d2);
  }
}

/// Fills `found`; returns the radius (m) within which all others were seen.
float PartnerSearch::search(Query& query) const {
  // Outside of the grid by more than the gate, where indices could also overflow.
  constexpr float beyond = kRings + 1;
  const Eigen::Vector3i& buckets = target_->grid.buckets();
  const Eigen::Array3f at = (query.p - origin_).array() * inverse_bucket_size_ + beyond;
  if (!((at > 0).all() && (at < buckets.cast<float>().array() + 2 * beyond).all())) return gate_ + margin_;
  const Eigen::Array3i own = at.cast<int>();
  const Eigen::Array3f place = at - own.cast<float>();
  const std::vector<Eigen::Vector3f>& means = target_->surfels.means;
  const AxisDistances along_y(place.y()), along_z(place.z());
  float nearest2 = query.nearest2, seen = std::sqrt(nearest2) + margin_,
        reach = seen * inverse_bucket_size_ + kRounding;
  for (const RowOffset& offset : kRowOffsets) {
    if (offset.distance2 > reach * reach) break;
    const int y = own.y() + offset.y - static_cast<int>(beyond),
              z = own.z() + offset.z - static_cast<int>(beyond);
    const float left2 = reach * reach - along_y[offset.y] - along_z[offset.z];
    if (left2 < 0 || y < 0 || z < 0 || y >= buckets.y() || z >= buckets.z()) continue;
    const float left = std::sqrt(left2);
    const int x0 = std::max(static_cast<int>(std::max(at.x() - left, 0.0f)) - static_cast<int>(beyond), 0);
    const int x1 = std::min(static_cast<int>(at.x() + left) - static_cast<int>(beyond), buckets.x() - 1);
    const BucketGrid::Range run = target_->grid.row(x0, x1, y, z);
    for (std::uint32_t j = run.begin; j < run.end; ++j) {
      const float d2 = (means[j] - query.p).squaredNorm();
      if (d2 > seen * seen) continue;
      consider(query, j, d2);
      if (query.nearest2 < nearest2) {
        nearest2 = query.nearest2;
        seen = std::sqrt(nearest2) + margin_;
        reach = seen * inverse_bucket_size_ + kRounding;
      }
    }
  }
  return std::min(seen, std::sqrt(query.other2));
}

void PartnerSearch::update(std::size_t i) {
  Tracked& tracked = tracked_[i];
  const Eigen::Vector3f& mean = source_->means[i];
  Query query{R_ * mean + t_, R_ * source_->normals[i], source_->slack[i] < kFlatEnough, gate_ * gate_,
              std::numeric_limits<float>::infinity()};
  const auto j = static_cast<std::uint32_t>(tracked.partner);
  float d2 = 0;
  if (tracked.partner >= 0) d2 = (target_->surfels.means[j] - query.p).squaredNorm();
  if (tracked.clearance >= 0 && turned_ < tracked.turn) {
    const float slip = 1e-5f * (query.p.cwiseAbs().maxCoeff() + margin_);  // rounding error
    tracked.clearance -= (query.p - (R_last_ * mean + t_last_)).norm() + slip;
    const float certain = std::max(tracked.clearance, 0.0f);
    if (tracked.partner < 0) {
      if (certain > gate_) return;
    } else {
      if (d2 < certain * certain && d2 < query.nearest2 && facing(query, j) >= kMinCosine) return;
    }
  }
  if (tracked.partner >= 0) consider(query, j, d2);
  tracked.clearance = search(query);
  tracked.partner = query.found;
  tracked.turn = static_cast<float>(turned_) + kTurnToHope;
}

}  // namespace parhelion::cloud
