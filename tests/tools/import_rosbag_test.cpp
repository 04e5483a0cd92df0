#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocols/frames.hpp"
#include "protocols/quantile.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/imported_log.hpp"
#include "tools/import/rosbag_reader.hpp"

namespace parhelion::tools {
namespace {

using test::ImportedLog;
using test::TemporaryFolder;

std::filesystem::path jarvis() {
  return test::recording("rosbag-jarvis-circular/jarvis_circular_path_fast.bag");
}

ImportOptions jarvis_options(const std::filesystem::path& input, const std::filesystem::path& output) {
  auto options = test::import_options(input, output);
  options.topics["SCAN"] = "/driver_laser_security/laser_scan";
  return options;
}

/// Reference pose at `stamp`, interpolated.
std::optional<Transform<Map, Base>> bag_reference_at(const std::vector<PoseStamped>& poses,
                                                     SensorTime stamp) {
  for (std::size_t i = 1; i < poses.size(); ++i) {
    if (poses[i - 1].stamp > stamp || poses[i].stamp < stamp) continue;
    const double s = (stamp - poses[i - 1].stamp).seconds() / (poses[i].stamp - poses[i - 1].stamp).seconds();
    return interpolate(poses[i - 1].T_map_base, poses[i].T_map_base, s);
  }
  return std::nullopt;
}

/// Median distance of hits to those of the scan ten later (1.2 s), all placed at the reference poses.
double wall_thickness(const ImportedLog& log, bool mirror) {
  const auto scans = log.all<Scan>(channel::kScan);
  const auto truth = log.all<PoseStamped>(channel::kReferencePose);
  const LaserDescription laser = *log.robot().laser;
  const auto points = [&](const Scan& scan) {
    const auto T_map_base = bag_reference_at(truth, scan.stamp);
    const Scan as = mirror ? test::mirrored(scan) : scan;
    return T_map_base ? test::hits(as, laser.convention, *T_map_base * laser.T_base_laser, 12)
                      : std::vector<Eigen::Vector2d>{};
  };
  std::vector<double> medians;
  for (std::size_t i = 0; i + 10 < scans.size(); i += 20) {
    const auto from = points(scans[i]), to = points(scans[i + 10]);
    if (!from.empty() && !to.empty()) medians.push_back(test::median_distance(from, to));
  }
  return medians.empty() ? std::numeric_limits<double>::infinity() : median(medians);
}

TEST(ImportRosbag, SeveralScanTopicsAreAnErrorThatListsThem) {
  PARHELION_NEEDS_RECORDING(jarvis());
  TemporaryFolder folder;
  const auto report = import_recording(test::import_options(jarvis(), folder / "jarvis.lcm"), {});
  ASSERT_FALSE(report.ok());
  EXPECT_THAT(report.error().message, ::testing::HasSubstr("SCAN=/driver_laser_navigation/laser_scan"));
  EXPECT_THAT(report.error().message, ::testing::HasSubstr("SCAN=/driver_laser_security/laser_scan"));
  EXPECT_FALSE(std::filesystem::exists(folder / "jarvis.lcm"));
}

TEST(ImportRosbag, ASweptLaserIsImportedOnRequestWithItsMounting) {
  PARHELION_NEEDS_RECORDING(jarvis());
  TemporaryFolder folder;
  auto options = test::import_options(jarvis(), folder / "jarvis.lcm");
  options.topics["LINES"] = "/driver_laser_navigation/laser_scan";
  const auto report = import_recording(options, {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  ASSERT_NE(report->find(channel::kLines), nullptr);
  ASSERT_NE(report->find(channel::kScan), nullptr) << "the other laser was not taken";
  const ImportedLog log(folder / "jarvis.lcm");
  EXPECT_EQ(log.all<Scan>(channel::kLines).size(), report->find(channel::kLines)->kept);
  const RobotDescription robot = log.robot();
  ASSERT_TRUE(robot.line_laser && robot.laser);
  EXPECT_TRUE(
      robot.line_laser->laser.T_base_laser.translation().isApprox(Eigen::Vector3d(0.194, 0, 2), 1e-9));
  EXPECT_TRUE(robot.laser->T_base_laser.translation().isApprox(Eigen::Vector3d(0.895, 0, 0.1), 1e-9));
}

TEST(ImportRosbag, ScansAtReferencePosesGiveThinWalls) {
  PARHELION_NEEDS_RECORDING(jarvis());
  TemporaryFolder folder;
  const auto report = import_recording(jarvis_options(jarvis(), folder / "jarvis.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->refused, 0U);
  EXPECT_EQ(report->find(channel::kScan)->kept, 213U);
  EXPECT_EQ(report->find(channel::kScan)->beams.at(761), 213U);
  EXPECT_EQ(report->find(channel::kReferencePose)->kept, 204U);
  const ImportedLog log(folder / "jarvis.lcm");
  log.expect_arrivals_increase();
  const double thin = wall_thickness(log, false), mirrored = wall_thickness(log, true);
  std::printf("median distance between scans 1.2 s apart: %.4f m, mirrored %.4f m\n", thin, mirrored);
  EXPECT_LT(thin, 0.03);
  EXPECT_GT(mirrored, 3 * thin);
}

TEST(ImportRosbag, DescriptionHasExtrinsicsAndTheStaticTransforms) {
  PARHELION_NEEDS_RECORDING(jarvis());
  TemporaryFolder folder;
  ASSERT_TRUE(import_recording(jarvis_options(jarvis(), folder / "jarvis.lcm"), {}).ok());
  const RobotDescription robot = ImportedLog(folder / "jarvis.lcm").robot();
  ASSERT_TRUE(robot.laser.has_value());
  EXPECT_TRUE(robot.laser->T_base_laser.translation().isApprox(Eigen::Vector3d(0.895, 0, 0.1), 1e-9));
  // ROS defines the first. But scans arrive before their last beam would then be measured.
  EXPECT_EQ(robot.laser->stamp_beam, LaserDescription::StampBeam::last);
  EXPECT_EQ(robot.laser->preset, "s3000");
  EXPECT_NEAR(robot.laser->scan_period, 0.12, 0.002);
  EXPECT_THAT(robot.source, ::testing::HasSubstr("base_footprint -> base_laser_navigation_link [0.194 0 2]"));
  EXPECT_THAT(robot.laser->source, ::testing::HasSubstr("time_increment 0 s"));
}

TEST(ImportRosbag, OdometryExcludesLocalizationCorrections) {
  PARHELION_NEEDS_RECORDING(jarvis());
  TemporaryFolder folder;
  ASSERT_TRUE(import_recording(jarvis_options(jarvis(), folder / "jarvis.lcm"), {}).ok());
  const ImportedLog log(folder / "jarvis.lcm");
  const auto odometry = log.all<Odometry>(channel::kOdometry);
  ASSERT_GT(odometry.size(), 600U);
  // The first odom -> base_footprint of the bag; odom -> map starts at (0.38, 2.80).
  EXPECT_NEAR(odometry[0].T_odom_base.translation().x(), 0.375217, 1e-5);
  EXPECT_NEAR(odometry[0].T_odom_base.translation().y(), 0.053704, 1e-5);
  double path = 0;
  for (std::size_t i = 1; i < odometry.size(); ++i) {
    const double step =
        (odometry[i].T_odom_base.translation() - odometry[i - 1].T_odom_base.translation()).norm();
    EXPECT_LT(step, 0.2) << "odometry is continuous";
    path += step;
  }
  EXPECT_NEAR(path, 11.4, 0.5);
}

TEST(ImportRosbag, ATruncatedBagKeepsEarlierMessages) {
  PARHELION_NEEDS_RECORDING(jarvis());
  TemporaryFolder folder;
  auto bytes = test::file_bytes(jarvis());
  bytes.resize(bytes.size() * 6 / 10);
  test::write_bytes(folder / "cut.bag", bytes);
  const auto report = import_recording(jarvis_options(folder / "cut.bag", folder / "cut.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_GT(report->find(channel::kScan)->kept, 80U);
  ASSERT_EQ(report->refused, 1U);
  EXPECT_THAT(report->refusals[0].why, ::testing::HasSubstr("cut off"));
}

TEST(ImportRosbag, FlippedBitsNeverCrashAndAreReported) {
  PARHELION_NEEDS_RECORDING(jarvis());
  TemporaryFolder folder;
  const auto whole = test::file_bytes(jarvis());
  std::uint64_t state = 7;
  for (int trial = 0; trial < 12; ++trial) {
    auto bytes = whole;
    for (int flip = 0; flip < 4; ++flip) {
      state = state * 6364136223846793005ULL + 1442695040888963407ULL;
      bytes[(state >> 20) % bytes.size()] ^= static_cast<char>(1U << ((state >> 60) & 7));
    }
    test::write_bytes(folder / "flipped.bag", bytes);
    auto options = jarvis_options(folder / "flipped.bag", folder / "flipped.lcm");
    options.overwrite = true;
    const auto report = import_recording(options, {});
    if (report) {
      EXPECT_GT(report->kept(), 0U);
    } else {
      EXPECT_FALSE(report.error().message.empty());
    }
  }
}

}  // namespace
}  // namespace parhelion::tools
