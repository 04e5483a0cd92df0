#include "tests/fusion/cloud/slow_registration.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <numbers>

#include "fusion/cloud/read_cloud.hpp"
#include "fusion/cloud/registration.hpp"
#include "tests/fusion/cloud/synthetic_scans.hpp"
#include "tests/recordings.hpp"

namespace parhelion::cloud {
namespace {

using test::pose;

/// The default against the reference, from one guess.
void compare(const std::vector<Eigen::Vector3f>& target, const std::vector<Eigen::Vector3f>& source,
             const Eigen::Isometry3d& guess, double max_degrees) {
  PointCloud<Target> a;
  a.points = target;
  PointCloud<Source> b;
  b.points = source;
  a.viewpoints = b.viewpoints = {Eigen::Vector3d::Zero()};
  const auto fast = register_pair(a, b, Transform<Target, Source>(guess));
  ASSERT_TRUE(fast.ok()) << fast.error().message;
  ASSERT_TRUE(fast->converged) << fast->why;
  const test::SlowRegistrar registrar(target, source, fitted_surfel_size(target));
  const test::SlowRegistration slow = registrar.run(guess, RegistrationOptions().max_distance);
  EXPECT_TRUE(slow.converged);
  const Eigen::Isometry3d apart = slow.T.inverse() * fast->T_target_source.isometry();
  const double degrees = Eigen::AngleAxisd(apart.linear()).angle() * 180 / std::numbers::pi;
  const double shift = (slow.T.translation() - fast->T_target_source.translation()).norm();
  std::printf("%zu + %zu points: default and twin (%d iterations) %.2f mm and %.3f degrees apart\n",
              target.size(), source.size(), slow.iterations, 1000 * shift, degrees);
  EXPECT_LT(shift, 0.005);
  EXPECT_LT(degrees, max_degrees);
}

TEST(SlowRegistration, AgreesWithTheDefaultOnAMadeUpRoom) {
  const Eigen::Isometry3d T_room_target = pose(-1, 0.3, 0, 0.1),
                          T_room_source = pose(0.6, -0.5, 0.1, 0.6, 0.02, -0.01);
  compare(test::scan(test::furnished_room(), T_room_target, 60, 0.005, 1),
          test::scan(test::furnished_room(), T_room_source, 60, 0.005, 2),
          T_room_target.inverse() * T_room_source * pose(0.2, -0.15, 0.05, 0.1), 0.05);
}

TEST(SlowRegistration, AgreesWithTheDefaultOnTheRoom) {
  const auto folder = test::recording("3d-room-scan");
  PARHELION_NEEDS_RECORDING(folder);
  const auto first = read_scan(folder / "room_scan1.pcd"), second = read_scan(folder / "room_scan2.pcd");
  ASSERT_TRUE(first.ok() && second.ok());
  // All points take half a minute; the short form uses every sixth.
  const std::size_t step = std::getenv("PARHELION_LONG") != nullptr ? 1 : 6;
  const auto thinned = [&](const std::vector<Eigen::Vector3f>& points) {
    std::vector<Eigen::Vector3f> result;
    for (std::size_t i = 0; i < points.size(); i += step) result.push_back(points[i]);
    return result;
  };
  compare(thinned(first->cloud.points), thinned(second->cloud.points), pose(1.79387, 0.720047, 0, 0.6931),
          step == 1 ? 0.05 : 0.2);
}

}  // namespace
}  // namespace parhelion::cloud
