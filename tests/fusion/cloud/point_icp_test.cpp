#include "fusion/cloud/point_icp.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/fusion/cloud/synthetic_scans.hpp"

namespace parhelion::cloud {
namespace {

using test::pose;

struct Clouds {
  std::vector<Eigen::Vector3f> target =
      test::scan(test::furnished_room(), pose(-1, 0.3, 0, 0.1), 40, 0.005, 1);
  std::vector<Eigen::Vector3f> source =
      test::scan(test::furnished_room(), pose(-0.8, 0.2, 0, 0.15), 40, 0.005, 2);
};

/// m^2 to the nearest point, by exhaustive search.
float nearest_slow(const std::vector<Eigen::Vector3f>& target, const Eigen::Vector3f& p) {
  float nearest = std::numeric_limits<float>::infinity();
  for (const Eigen::Vector3f& q : target) nearest = std::min(nearest, (q - p).squaredNorm());
  return nearest;
}

class BucketGrids : public testing::TestWithParam<bool> {};

TEST_P(BucketGrids, FindTheSameNearestPointsAsBruteForce) {
  const Clouds clouds;
  PointIcpOptions options;
  options.paper_grid = GetParam();
  PointIcp icp(clouds.target, clouds.source, options);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (int round = 0; round < 12; ++round) {
    const Eigen::Isometry3d next = icp.step(T);
    const std::vector<std::int32_t> found = icp.partners();
    ASSERT_EQ(found.size(), clouds.source.size());
    for (std::size_t i = 0; i < found.size(); i += 3) {
      const Eigen::Vector3f p = T.linear().cast<float>() * clouds.source[i] + T.translation().cast<float>();
      const float nearest = nearest_slow(clouds.target, p);
      if (found[i] < 0) {
        EXPECT_GT(nearest, 0.2499f) << round << " " << i;
      } else {
        EXPECT_NEAR((clouds.target[static_cast<std::size_t>(found[i])] - p).squaredNorm(), nearest, 1e-6f)
            << i;
      }
    }
    T = next;
  }
  EXPECT_LT(icp.searched(), clouds.source.size());
}

TEST_P(BucketGrids, AreBitIdenticalForAvx2AndAnyThreadCount) {
  const Clouds clouds;
  const auto run = [&](bool portable, int threads) {
    PointIcp icp(clouds.target, clouds.source,
                 {.paper_grid = GetParam(), .portable = portable, .threads = threads});
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    for (int i = 0; i < 10; ++i) T = icp.step(T);
    return std::pair(T.matrix(), icp.partners());
  };
  const auto expected = run(true, 1);
  EXPECT_EQ(run(false, 1), expected);
  EXPECT_EQ(run(false, 2), expected);
  EXPECT_EQ(run(true, 5), expected);
}

INSTANTIATE_TEST_SUITE_P(TreeAndPaper, BucketGrids, testing::Bool());

TEST(PointIcp, ConvergesOnTheKnownMotion) {
  const Clouds clouds;
  PointIcp icp(clouds.target, clouds.target, {});
  Eigen::Isometry3d T = pose(0.05, -0.03, 0.02, 0.02);
  for (int i = 0; i < 60; ++i) T = icp.step(T);
  EXPECT_LT(T.translation().norm(), 1e-3);
}

TEST(ClosestMotion, RecoversTheRotationAndNeverAReflection) {
  std::mt19937 generator(3);
  std::normal_distribution<double> normal;
  for (int flat = 0; flat < 2; ++flat) {
    const Eigen::Isometry3d truth = pose(1, -2, 0.5, 2.5, 0.4, -0.8);
    PairMoments moments;
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector3d a(normal(generator), normal(generator), flat == 1 ? 0 : normal(generator));
      const Eigen::Vector3d b = truth * a;
      moments += {1, a, b, b * a.transpose(), 0};
    }
    EXPECT_TRUE(closest_motion(moments).isApprox(truth, 1e-9)) << flat;
    EXPECT_NEAR(closest_motion(moments).linear().determinant(), 1, 1e-9);
  }
}

}  // namespace
}  // namespace parhelion::cloud
