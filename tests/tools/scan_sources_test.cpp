// 3D scans from folders, logs and guesses of the user.
#include "tools/map/scan_sources.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "protocols/bus/log_file.hpp"
#include "protocols/codec.hpp"
#include "protocols/robot.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/imported_log.hpp"
#include "tests/tools/process.hpp"
#include "tests/tools/robot_log.hpp"
#include "tools/map/scan_guess.hpp"

namespace parhelion::tools {
namespace {

using test::RobotLog;
using test::TemporaryFolder;

/// Median of the heights in the densest layer of 4 cm, in the cloud's frame.
double densest_height(const std::vector<cloud::ScanToRegister>& scans) {
  std::map<int, int> layers;
  for (const cloud::ScanToRegister& scan : scans) {
    for (const Eigen::Vector3f& p : scan.cloud.points) {
      const Eigen::Vector3d in_cloud = scan.guess * p.cast<double>().eval();
      ++layers[static_cast<int>(std::floor(in_cloud.z() / 0.04))];
    }
  }
  const auto fullest = std::max_element(layers.begin(), layers.end(),
                                        [](const auto& a, const auto& b) { return a.second < b.second; });
  return 0.04 * fullest->first + 0.02;
}

TEST(ScanSources, kitchen_depth_images_are_levelled_with_correct_table_height) {
  const auto kitchen = test::recording("rgbd-7scenes-redkitchen-a");
  PARHELION_NEEDS_RECORDING(kitchen);
  ScanSourceOptions options;
  options.pixel_step = 8;
  const auto opened = open_scans({kitchen.string()}, options);
  ASSERT_TRUE(opened) << opened.error().message;
  EXPECT_GT(opened->scans.size(), 10U);
  EXPECT_LE(opened->scans.size(), 100U);
  for (const cloud::ScanToRegister& scan : opened->scans) EXPECT_TRUE(scan.has_guess);
  // The densest layer is the table top, 0.76 m below the world's origin.
  EXPECT_NEAR(densest_height(opened->scans), -0.76, 0.06);
}

TEST(ScanSources, folders_of_3dtk_are_read_by_name_with_poses) {
  const auto corridor = test::recording("3d-3dtk-corridor");
  PARHELION_NEEDS_RECORDING(corridor);
  auto opened = open_scans({corridor.string()}, {});
  ASSERT_TRUE(opened) << opened.error().message;
  ASSERT_EQ(opened->scans.size(), 3U);
  place_guesses(opened->scans);
  EXPECT_NEAR(opened->scans[1].guess.translation().x(), 1.569, 0.001);
  EXPECT_NEAR(opened->scans[2].guess.translation().x(), 3.380, 0.001);
}

/// A robot with a laser that looks across its way, driving 10 m down a corridor 2 m wide and 2.5 m high.
void write_corridor_log(const std::string& path) {
  RobotDescription robot;
  robot.laser.emplace();
  Eigen::Matrix3d R;
  R << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  robot.laser->T_base_laser = Transform<Base, Laser>(Eigen::Quaterniond(R), {0.1, 0, 0.5});
  robot.laser->convention.range_min = 0.05F;
  robot.laser->convention.range_max = 30;
  RobotLog log(path, robot);
  for (int i = 0; i <= 100; ++i) {
    const auto stamp = SensorTime::from_utime(1'000'000 + 100'000 * i);
    PoseEstimate pose;
    pose.stamp = stamp;
    pose.T_map_base = Transform<Map, Base>::planar(0.1 * i, 0, 0);
    pose.state = SlamState::tracking;
    pose.map_id = "corridor";
    log.write("POSE_COV", pose);
    Scan line;
    line.stamp = stamp;
    line.angle_increment = static_cast<float>(2 * 3.14159265358979 / 180);
    for (int k = 0; k < 180; ++k) {
      const double angle = static_cast<double>(line.angle_increment) * k, y = std::cos(angle),
                   z = std::sin(angle);
      const double level = z > 1e-9 ? 2.0 / z : z < -1e-9 ? -0.5 / z : 1e9;
      line.ranges.push_back(static_cast<float>(std::min(1 / std::max(1e-9, std::abs(y)), level)));
    }
    log.write("SCAN", line);
  }
}

TEST(ScanSources, scan_lines_are_grouped_into_3d_scans_by_distance) {
  const TemporaryFolder folder;
  write_corridor_log(folder / "corridor.lcm");
  const auto opened = open_scans({folder / "corridor.lcm"}, {});
  ASSERT_TRUE(opened) << opened.error().message;
  ASSERT_EQ(opened->scans.size(), 3U);
  for (const cloud::ScanToRegister& scan : opened->scans) {
    for (const Eigen::Vector3f& p : scan.cloud.points) {
      const Eigen::Vector3d q = scan.guess * p.cast<double>().eval();
      const double off = std::min({std::abs(std::abs(q.y()) - 1), std::abs(q.z()), std::abs(q.z() - 2.5)});
      ASSERT_LT(off, 1e-3);
    }
  }
}

TEST(ScanSources, the_cloud_of_a_log_is_in_the_map_frame) {
  const TemporaryFolder folder;
  write_corridor_log(folder / "corridor.lcm");
  for (const bool trusted : {false, true}) {
    std::vector<std::string> words = {
        "map", "register", folder / "corridor.lcm", "-o", folder / "c.ply", "--force", "--keep-going"};
    if (trusted) words.push_back("--trust-poses");
    const auto ran = test::run(words, folder / "log");
    ASSERT_EQ(ran.exit, 0) << ran.output;
    const auto cloud = cloud::read_scan(folder / "c.ply");
    ASSERT_TRUE(cloud) << cloud.error().message;
    Eigen::AlignedBox3f box;
    for (const Eigen::Vector3f& p : cloud->cloud.points) box.extend(p);
    EXPECT_NEAR(box.min().x(), 0.1, 0.01);
    EXPECT_NEAR(box.min().z(), 0, 0.01);
    EXPECT_NEAR(box.max().z(), 2.5, 0.01);
  }
}

/// A stationary robot in a hall of 20 x 2 x 2.5 m that nods its level laser by 0.7 rad up and down; the lines
/// are on `channel`. Its own rear, 0.6 m long and wide, occludes the first five beams.
void write_nodding_log(const std::string& path, const char* lines) {
  RobotDescription robot;
  LaserDescription laser;
  laser.T_base_laser = Transform<Base, Laser>::planar(0, 0, 0, 0.5);
  laser.convention.range_min = 0.05F;
  laser.convention.range_max = 30;
  if (lines == std::string(channel::kLines)) {
    robot.line_laser = {laser, {{"nod", {0, 0, 0.5}, Eigen::Vector3d::UnitY()}}};
  } else {
    robot.laser = laser;
  }
  robot.footprint = {{-0.3, -0.3}, {0.3, -0.3}, {0.3, 0.3}, {-0.3, 0.3}};
  robot.height = 1;
  RobotLog log(path, robot);
  for (int i = 0; i <= 70; ++i) {
    const auto stamp = SensorTime::from_utime(1'000'000 + 50'000 * i);
    const double tilt = 0.02 * i - 0.7;
    PoseEstimate pose;
    pose.stamp = stamp;
    pose.state = SlamState::tracking;
    pose.map_id = "hall";
    log.write("POSE_COV", pose);
    log.write("JOINT_STATE", Joints{stamp, {"nod"}, {tilt}, {}, {}});
    Scan line;
    line.stamp = stamp;
    line.angle_min = -1.5F;
    line.angle_increment = 0.03F;
    for (int k = 0; k <= 100; ++k) {
      const double angle =
          static_cast<double>(line.angle_min) + static_cast<double>(line.angle_increment) * k;
      const double x = std::cos(angle) * std::cos(tilt), y = std::sin(angle),
                   z = -std::cos(angle) * std::sin(tilt);
      const auto to = [](double plane, double along) { return along * plane > 0 ? plane / along : 1e9; };
      const double range = std::min({to(10, x), to(1, y), to(-1, y), to(2, z), to(-0.5, z)});
      line.ranges.push_back(k < 5 ? 0.3F : static_cast<float>(range));
    }
    log.write(lines, line);
  }
}

void expect_hall(const OpenedScans& opened) {
  ASSERT_EQ(opened.scans.size(), 1U);
  EXPECT_EQ(opened.scans[0].cloud.size(), 71U * 96U) << "without the robot itself";
  for (const Eigen::Vector3f& p : opened.scans[0].cloud.points) {
    const float off = std::min(
        {std::abs(std::abs(p.y()) - 1), std::abs(p.z()), std::abs(p.z() - 2.5F), std::abs(p.x() - 10)});
    ASSERT_LT(off, 2e-3F) << p.transpose();
  }
}

TEST(ScanSources, nodding_laser_lines_are_placed_by_its_joint) {
  const TemporaryFolder folder;
  write_nodding_log(folder / "hall.lcm", channel::kScan);
  EXPECT_FALSE(open_scans({folder / "hall.lcm"}, {})) << "a level laser makes no 3D scan";
  ScanSourceOptions options;
  options.tilt_joint = "nod";
  const auto opened = open_scans({folder / "hall.lcm"}, options);
  ASSERT_TRUE(opened) << opened.error().message;
  expect_hall(*opened);
  options.tilt_joint = "neck";
  EXPECT_FALSE(open_scans({folder / "hall.lcm"}, options));
}

TEST(ScanSources, head_laser_lines_are_placed_by_the_robot_description) {
  const TemporaryFolder folder;
  write_nodding_log(folder / "hall.lcm", channel::kLines);
  const auto opened = open_scans({folder / "hall.lcm"}, {});
  ASSERT_TRUE(opened) << opened.error().message;
  expect_hall(*opened);
}

TEST(ScanSources, depth_images_of_a_log_match_those_of_its_folder) {
  const auto kitchen = test::recording("rgbd-7scenes-redkitchen-a");
  PARHELION_NEEDS_RECORDING(kitchen);
  const TemporaryFolder folder;
  const auto report = import_recording(test::import_options(kitchen, folder / "kitchen.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  ScanSourceOptions options;
  options.pixel_step = 8;
  const auto opened = open_scans({folder / "kitchen.lcm"}, options);
  ASSERT_TRUE(opened) << opened.error().message;
  EXPECT_GT(opened->scans.size(), 10U);
  // The import defines the floor as z = 0: the table is 0.72 m high.
  EXPECT_NEAR(densest_height(opened->scans), 0.72, 0.06);
}

TEST(ScanSources, inputs_without_scans_are_refused_with_expected_formats) {
  const TemporaryFolder folder;
  std::ofstream(folder / "readme.md") << "no scan";
  EXPECT_FALSE(open_scans({folder / "readme.md"}, {}));
  EXPECT_FALSE(open_scans({folder / "absent.ply"}, {}));
  const auto empty = open_scans({folder / ""}, {});
  ASSERT_FALSE(empty);
  EXPECT_NE(empty.error().message.find("frame-000000.depth.png"), std::string::npos);
}

TEST(ScanGuess, gives_the_pose_of_the_second_scan_or_of_each_scan) {
  const TemporaryFolder folder;
  std::vector<cloud::ScanToRegister> scans(2);
  ASSERT_TRUE(apply_guess("1,2,3,90", scans));
  EXPECT_TRUE((scans[1].guess * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(1, 3, 3)));
  std::ofstream(folder / "guess.txt") << "# x y z yaw\n1 0 0 90\n0 1 0 0  1 0 0 0  0 0 1 0  0 0 0 1\n";
  EXPECT_FALSE(apply_guess(folder / "guess.txt", scans)) << "a mirroring is no pose";
  std::ofstream(folder / "guess.txt") << "1 0 0 90\n1 1 0 90\n";
  ASSERT_TRUE(apply_guess(folder / "guess.txt", scans));
  EXPECT_TRUE(scans[1].guess.translation().isApprox(Eigen::Vector3d(1, 0, 0)));
  EXPECT_FALSE(apply_guess("1,2,3", scans));
  EXPECT_FALSE(apply_guess("1,2,3,inf", scans));
  scans.resize(3);
  EXPECT_FALSE(apply_guess("1,2,3,4", scans));
  EXPECT_FALSE(apply_guess(folder / "guess.txt", scans));
}

}  // namespace
}  // namespace parhelion::tools
