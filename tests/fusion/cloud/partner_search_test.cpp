#include "fusion/cloud/partner_search.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "tests/fusion/cloud/synthetic_scans.hpp"

namespace parhelion::cloud {
namespace {

using test::pose;

Surfels surfels_of(const Eigen::Isometry3d& T, unsigned seed, bool oriented) {
  const std::vector<Eigen::Vector3f> points = test::scan(test::furnished_room(), T, 50, 0.005, seed);
  const std::vector<Eigen::Vector3d> viewpoint = {Eigen::Vector3d::Zero()};
  return VoxelMoments(points, 0.15, {}, oriented ? std::span(viewpoint) : std::span<const Eigen::Vector3d>{})
      .surfels();
}

/// Reference: checks each surfel of the target.
std::int32_t partner_slow(const Surfels& target, const Surfels& source, std::size_t i,
                          const Eigen::Isometry3d& T, float gate) {
  const Eigen::Matrix3f R = T.linear().cast<float>();
  const Eigen::Vector3f p = R * source.means[i] + T.translation().cast<float>();
  const Eigen::Vector3f n = R * source.normals[i];
  std::int32_t best = -1;
  float nearest = gate * gate;
  for (std::size_t j = 0; j < target.count(); ++j) {
    const float d2 = (target.means[j] - p).squaredNorm();
    if (!(d2 < nearest)) continue;
    if (source.slack[i] < PartnerSearch::kFlatEnough && target.slack[j] < PartnerSearch::kFlatEnough) {
      const float cosine = n.dot(target.normals[j]);
      if ((source.oriented && target.oriented ? cosine : std::abs(cosine)) < 0.5f) continue;
    }
    nearest = d2;
    best = static_cast<std::int32_t>(j);
  }
  return best;
}

class PartnerSearches : public testing::TestWithParam<bool> {};

// A sequence of large and small moves, so that partners are kept, changed, lost and found again.
TEST_P(PartnerSearches, FindTheSamePartnersAsBruteForce) {
  const SurfelTarget target(surfels_of(pose(-1, 0.3, 0, 0.1), 1, GetParam()));
  const Surfels source = surfels_of(pose(0.4, -0.4, 0.1, 0.5), 2, GetParam());
  const float gate = 2.5f * 0.15f;
  PartnerSearch search(target, source, gate);
  std::size_t found = 0;
  const std::vector<Eigen::Isometry3d> path = {
      pose(1.2, -0.9, 0, 0.3),         pose(1.3, -0.85, 0.1, 0.38), pose(1.302, -0.851, 0.1, 0.381),
      pose(1.303, -0.851, 0.1, 0.381), pose(1.303, -0.85, 0.1, 3),  pose(50, 1e12, 0, 0),
      pose(1.303, -0.85, 0.1, 0.4),    pose(1.3, -0.86, 0.1, 0.405)};
  for (const Eigen::Isometry3d& T : path) {
    search.move_to(T);
    for (std::size_t i = 0; i < source.count(); ++i) {
      search.update(i);
      ASSERT_EQ(search.partner(i), partner_slow(target.surfels, source, i, T, gate)) << i;
      found += search.partner(i) >= 0;
    }
  }
  EXPECT_GT(found, source.count());
}

INSTANTIATE_TEST_SUITE_P(WithViewpointsAndWithout, PartnerSearches, testing::Bool());

}  // namespace
}  // namespace parhelion::cloud
