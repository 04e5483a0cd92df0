// Clouds from depth images and moving lasers, in known surroundings.
#include "fusion/cloud/sensor_cloud.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace parhelion::cloud {
namespace {

CameraIntrinsics kinect() {
  CameraIntrinsics camera;
  camera.width = 64;
  camera.height = 48;
  camera.fx = camera.fy = 58.5;
  camera.cx = 32;
  camera.cy = 24;
  return camera;
}

TEST(CloudFromDepth, pixels_lie_on_their_rays_and_unmeasured_ones_are_omitted) {
  const CameraIntrinsics camera = kinect();
  std::vector<std::uint16_t> depth(64 * 48, 0);
  depth[24 * 64 + 32] = 2000;
  depth[34 * 64 + 12] = 1000;
  depth[0] = 65535;
  const auto cloud = cloud_from_depth(depth, camera);
  ASSERT_TRUE(cloud);
  ASSERT_EQ(cloud->size(), 2U);
  EXPECT_TRUE(cloud->points[0].isApprox(Eigen::Vector3f(0, 0, 2)));
  EXPECT_TRUE(cloud->points[1].isApprox(Eigen::Vector3f(-20 / 58.5F, 10 / 58.5F, 1)));
  // A level camera that looks along x of its map: forward, left, up.
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const Transform<Map, DepthOptical> T(Eigen::Quaterniond(R), {7, 8, 9});
  const PointCloud<Scanner> level = turned_level(*cloud, T);
  EXPECT_TRUE(level.points[1].isApprox(Eigen::Vector3f(1, 20 / 58.5F, -10 / 58.5F), 1e-5F));
  EXPECT_EQ(level.viewpoints[0], Eigen::Vector3d::Zero());
}

TEST(CloudFromDepth, lens_distortion_is_taken_out) {
  for (const auto lens : {CameraIntrinsics::Lens::radial_tangential, CameraIntrinsics::Lens::fisheye}) {
    CameraIntrinsics camera = kinect();
    camera.lens = lens;
    camera.distortion = {-0.2, 0.05, 0.001, -0.002, 0};
    std::vector<std::uint16_t> depth(64 * 48, 1000);
    const auto cloud = cloud_from_depth(depth, camera);
    ASSERT_TRUE(cloud);
    ASSERT_EQ(cloud->size(), depth.size());
    // The corner pixel's ray, projected through the lens again, returns to the pixel.
    const double x = static_cast<double>(cloud->points[0].x()), y = static_cast<double>(cloud->points[0].y());
    const auto& d = camera.distortion;
    const double r2 = x * x + y * y, r = std::sqrt(r2), theta = std::atan(r), t2 = theta * theta;
    const bool fisheye = lens == CameraIntrinsics::Lens::fisheye;
    const double scale =
        fisheye
            ? theta * (1 + d[0] * t2 + d[1] * t2 * t2 + d[2] * std::pow(t2, 3) + d[3] * std::pow(t2, 4)) / r
            : 1 + d[0] * r2 + d[1] * r2 * r2;
    const double u = x * scale + (fisheye ? 0 : 2 * d[2] * x * y + d[3] * (r2 + 2 * x * x));
    const double v = y * scale + (fisheye ? 0 : d[2] * (r2 + 2 * y * y) + 2 * d[3] * x * y);
    EXPECT_NEAR(camera.fx * u + camera.cx, 0, 1e-3);
    EXPECT_NEAR(camera.fy * v + camera.cy, 0, 1e-3);
  }
}

TEST(CloudFromDepth, an_image_that_does_not_fit_the_camera_is_refused) {
  const std::vector<std::uint16_t> depth(64 * 47, 1000);
  EXPECT_FALSE(cloud_from_depth(depth, kinect()));
  EXPECT_FALSE(cloud_from_depth(std::vector<std::uint16_t>(64 * 48), kinect(), {.step = 0}));
  CameraIntrinsics blind = kinect();
  blind.fx = 0;
  EXPECT_FALSE(cloud_from_depth(std::vector<std::uint16_t>(64 * 48), blind));
}

/// A laser in the vertical plane across the direction of travel, on a robot in a corridor of 2 m by 2.5 m,
/// 0.5 m over the floor.
Scan line_across(SensorTime stamp) {
  Scan line;
  line.stamp = stamp;
  line.angle_min = 0;
  line.angle_increment = static_cast<float>(2 * 3.14159265358979 / 180);
  for (int i = 0; i < 180; ++i) {
    const double angle = static_cast<double>(line.angle_increment) * i;
    const double y = std::cos(angle), z = std::sin(angle);
    const double side = std::abs(y) > 1e-9 ? 1 / std::abs(y) : 1e9;
    const double level = z > 1e-9 ? 2.0 / z : z < -1e-9 ? 0.5 / -z : 1e9;
    line.ranges.push_back(static_cast<float>(std::min(side, level)));
  }
  return line;
}

TEST(CloudFromLines, each_beam_uses_the_laser_pose_at_its_own_time) {
  LaserDescription laser;
  laser.convention.range_max = 30;
  laser.beam_interval = 0.001;
  std::vector<Scan> lines;
  for (int i = 0; i < 50; ++i)
    lines.push_back(line_across(SensorTime::from_utime(1'000'000 + 200'000LL * i)));
  Eigen::Matrix3d R;  // the laser's x to the left, y up, z ahead
  R << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  constexpr double speed = 0.5;
  const LaserPoseAt pose_at = [&](SensorTime t) -> std::optional<Transform<Scanner, Laser>> {
    const double s = (t - SensorTime::from_utime(1'000'000)).seconds();
    if (s > 9) return std::nullopt;
    return Transform<Scanner, Laser>(Eigen::Quaterniond(R), {speed * s, 0, 0.5});
  };
  const auto scan = cloud_from_lines(lines, laser, pose_at);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_GT(scan->without_pose, 0U);
  EXPECT_EQ(scan->cloud.size(), (lines.size() - scan->without_pose) * 180);
  for (const Eigen::Vector3f& p : scan->cloud.points) {
    const float off = std::min({std::abs(std::abs(p.y()) - 1), std::abs(p.z()), std::abs(p.z() - 2.5F)});
    EXPECT_LT(off, 1e-4F);
  }
  // The last beam of a line is 179 ms later than its first.
  EXPECT_NEAR(static_cast<double>(scan->cloud.points[179].x() - scan->cloud.points[0].x()), speed * 0.179,
              1e-5);
  EXPECT_FALSE(cloud_from_lines({}, laser, pose_at));
}

/// An upright laser over a robot of 0.8 x 0.6 x 0.7 m, turned about the vertical axis.
TEST(CloudFromLines, points_on_the_own_robot_are_omitted) {
  LaserDescription laser;
  laser.convention.range_max = 30;
  const OwnBody body{{{-0.4, -0.3}, {0.4, -0.3}, {0.4, 0.3}, {-0.4, 0.3}}, 0.7};
  std::vector<PlacedLine> lines;
  std::vector<Scan> without;
  for (int i = 0; i < 36; ++i) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.1 * i, Eigen::Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX()));
    const Transform<Base, Laser> T_base_laser(turn, {0.2, 0, 1.0});
    Scan line;
    line.stamp = SensorTime::from_utime(1'000'000 + 25'000LL * i);
    line.angle_increment = static_cast<float>(2 * std::numbers::pi / 180);
    for (int k = 0; k < 180; ++k)
      line.ranges.push_back(0.2F + 0.01F * static_cast<float>((k * 37 + i) % 180));
    const Transform<Map, Base> T_map_base = Transform<Map, Base>::planar(3, -2, 0.7);
    const auto T_map_laser = T_map_base * T_base_laser;
    lines.push_back({line, T_map_laser, T_map_laser, T_base_laser});
    leave_out_body(line, laser, T_base_laser, body);
    without.push_back(line);
  }
  const PointCloud<Map> cloud = cloud_from_lines(lines, laser, body);
  const Transform<Base, Map> T_base_map = Transform<Map, Base>::planar(3, -2, 0.7).inverse();
  for (const Eigen::Vector3f& p : cloud.points) {
    const Eigen::Vector3d q = T_base_map * p.cast<double>().eval();
    EXPECT_TRUE(std::abs(q.x()) > 0.449 || std::abs(q.y()) > 0.349 || q.z() > 0.749 || q.z() < -0.049)
        << q.transpose();
  }
  EXPECT_LT(cloud.size(), 36U * 180U - 300U) << "the robot is in the way of some";
  EXPECT_GT(cloud.size(), 36U * 180U / 2) << "not of most";
  EXPECT_EQ(cloud_from_lines(lines, laser, {}).size(), 36U * 180U)
      << "a body that is not known hides nothing";
  std::size_t hits = 0;
  for (const Scan& line : without)
    hits += static_cast<std::size_t>(std::count_if(line.ranges.begin(), line.ranges.end(), [&](float range) {
      return laser.convention.classify(range) == BeamKind::hit;
    }));
  EXPECT_EQ(hits, cloud.size()) << "the same beams, line by line";
}

}  // namespace
}  // namespace parhelion::cloud
