#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>
#include <sys/resource.h>
#include <zlib.h>

#include <cmath>
#include <random>

#include "fusion/pose/maps/mapped_scan.hpp"
#include "protocols/quantile.hpp"
#include "tests/long_run.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/imported_log.hpp"

namespace parhelion::tools {
namespace {

using test::ImportedLog;
using test::TemporaryFolder;

/// Median over every tenth pair of scans, five apart, placed at the odometry of their stamps.
double overlap(const ImportedLog& log, bool mirror) {
  const auto scans = log.all<Scan>(channel::kScan);
  const auto odometry = log.all<Odometry>(channel::kOdometry);
  const RobotDescription robot = log.robot();
  const auto at = [&](const Scan& scan) {
    const auto after =
        std::find_if(odometry.begin(), odometry.end(), [&](const auto& o) { return o.stamp >= scan.stamp; });
    return (after == odometry.end() ? odometry.back() : *after).T_odom_base * robot.laser->T_base_laser;
  };
  const auto points = [&](const Scan& scan) {
    return test::hits(mirror ? test::mirrored(scan) : scan, robot.laser->convention, at(scan), 15);
  };
  std::vector<double> medians;
  for (std::size_t i = 0; i + 5 < scans.size(); i += 10) {
    medians.push_back(test::median_distance(points(scans[i]), points(scans[i + 5])));
  }
  return median(medians);
}

TEST(ImportRawlog, PairedFormatGivesEachScanItsAccumulatedOdometry) {
  PARHELION_NEEDS_RECORDING(test::sena_rawlog());
  TemporaryFolder folder;
  const auto report = import_recording(test::import_options(test::sena_rawlog(), folder / "sena.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->read, 449U);
  EXPECT_EQ(report->refused, 0U);
  const ImportedLog log(folder / "sena.lcm");
  log.expect_arrivals_increase();
  const auto scans = log.all<Scan>(channel::kScan);
  const auto odometry = log.all<Odometry>(channel::kOdometry);
  ASSERT_EQ(scans.size(), 225U);
  // The origin, at the first scan, and the 224 actions.
  ASSERT_EQ(odometry.size(), 225U);
  for (std::size_t i = 0; i < scans.size(); ++i) {
    ASSERT_EQ(scans[i].ranges.size(), 361U);
    ASSERT_EQ(scans[i].stamp, odometry[i].stamp);
  }
  EXPECT_EQ(odometry[0].T_odom_base.translation(), Eigen::Vector3d::Zero());
  // MRPT's own composition of the 224 increments.
  EXPECT_NEAR(odometry.back().T_odom_base.translation().x(), -4.802438, 1e-4);
  EXPECT_NEAR(odometry.back().T_odom_base.translation().y(), -21.163699, 1e-4);
  EXPECT_NEAR(odometry.back().T_odom_base.yaw(), -106.704061 * M_PI / 180, 1e-5);
}

TEST(ImportRawlog, LaserDescriptionMatchesTheRawlog) {
  PARHELION_NEEDS_RECORDING(test::sena_rawlog());
  TemporaryFolder folder;
  ASSERT_TRUE(import_recording(test::import_options(test::sena_rawlog(), folder / "sena.lcm"), {}).ok());
  const ImportedLog log(folder / "sena.lcm");
  const RobotDescription robot = log.robot();
  ASSERT_TRUE(robot.laser.has_value());
  EXPECT_TRUE(robot.laser->T_base_laser.translation().isApprox(Eigen::Vector3d(0.78, 0, 0.3), 1e-6));
  EXPECT_EQ(robot.laser->beams, 361);
  EXPECT_NEAR(robot.laser->angle_min, -M_PI / 2, 1e-6);
  EXPECT_NEAR(robot.laser->angle_increment, M_PI / 360, 1e-8);
  EXPECT_FLOAT_EQ(robot.laser->convention.range_max, 80);
  // The error codes of an LMS-200 (81.83, 81.87, 81.89, 81.91) all mean no return.
  for (const float code : {81.83F, 81.87F, 81.89F, 81.91F}) {
    EXPECT_EQ(robot.laser->convention.classify(code), BeamKind::no_return) << code;
  }
  EXPECT_EQ(robot.laser->convention.classify(1.55F), BeamKind::hit);
  EXPECT_NEAR(robot.laser->scan_period, 0.26, 0.05);
}

TEST(ImportRawlog, ScansAlignByOdometryAndNotWhenMirrored) {
  PARHELION_NEEDS_RECORDING(test::sena_rawlog());
  TemporaryFolder folder;
  ASSERT_TRUE(import_recording(test::import_options(test::sena_rawlog(), folder / "sena.lcm"), {}).ok());
  const ImportedLog log(folder / "sena.lcm");
  const double right = overlap(log, false), wrong = overlap(log, true);
  std::printf("median distance between scans 1.3 s apart: %.3f m, mirrored %.3f m\n", right, wrong);
  // The wheelchair's wheels slip by 0.3 m in 1.3 s.
  EXPECT_LT(right, 0.35);
  EXPECT_GT(wrong, 3 * right);
}

TEST(ImportRawlog, ObservationFormatKeepsScansAndAsynchronousOdometry) {
  const auto input = test::recording("slam2d-ual-car/ual_dataset_2014_05_23_2dlaser_odo.rawlog");
  PARHELION_NEEDS_RECORDING(input);
  TemporaryFolder folder;
  const auto report = import_recording(test::import_options(input, folder / "ual.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->refused, 0U);
  ASSERT_NE(report->find(channel::kScan), nullptr);
  EXPECT_EQ(report->find(channel::kScan)->kept, 3318U);
  EXPECT_EQ(report->find(channel::kScan)->beams.at(361), 3318U);
  EXPECT_EQ(report->find(channel::kOdometry)->kept, 15351U);
  const ImportedLog log(folder / "ual.lcm");
  log.expect_arrivals_increase();
  const auto scans = log.all<Scan>(channel::kScan);
  const double span = (scans.back().stamp - scans.front().stamp).seconds();
  EXPECT_NEAR(static_cast<double>(scans.size() - 1) / span, 18.3, 0.1);
  EXPECT_EQ(log.robot().laser->T_base_laser.translation(),
            Eigen::Vector3d(2, 0, 0.4).cast<float>().cast<double>())
      << log.robot().laser->T_base_laser.translation().transpose();
}

TEST(ImportRawlog, TruncatedFileKeepsReadablePartAndReportsItsEnd) {
  PARHELION_NEEDS_RECORDING(test::sena_rawlog());
  TemporaryFolder folder;
  auto bytes = test::file_bytes(test::sena_rawlog());
  bytes.resize(bytes.size() / 2);
  test::write_bytes(folder / "half.rawlog", bytes);
  const auto report = import_recording(test::import_options(folder / "half.rawlog", folder / "half.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_GT(report->find(channel::kScan)->kept, 90U);
  EXPECT_LT(report->find(channel::kScan)->kept, 140U);
  ASSERT_EQ(report->refused, 1U);
  EXPECT_EQ(report->damaged, 1U);
  EXPECT_THAT(report->refusals[0].place, ::testing::StartsWith("half.rawlog, object 2"));
  EXPECT_THAT(report->refusals[0].why, ::testing::HasSubstr("byte"));
}

/// Inflated, so that a flipped bit reaches the objects.
std::vector<char> inflated(const std::filesystem::path& path) {
  std::vector<char> bytes(4 << 20);
  gzFile file = gzopen(path.c_str(), "rb");
  bytes.resize(
      static_cast<std::size_t>(std::max(0, gzread(file, bytes.data(), static_cast<unsigned>(bytes.size())))));
  gzclose(file);
  return bytes;
}

TEST(ImportRawlog, FlippedBitsNeverCrashAndNearlyAllIsKept) {
  PARHELION_NEEDS_RECORDING(test::sena_rawlog());
  TemporaryFolder folder;
  const auto whole = inflated(test::sena_rawlog());
  std::uint64_t state = 1;
  for (int trial = 0; trial < 60; ++trial) {
    auto bytes = whole;
    for (int flip = 0; flip < 5; ++flip) {
      state = state * 6364136223846793005ULL + 1442695040888963407ULL;
      // Half of the flips go to the first object, where they do most damage.
      const std::size_t range = flip % 2 == 0 ? bytes.size() : 400;
      bytes[(state >> 20) % range] ^= static_cast<char>(1U << ((state >> 60) & 7));
    }
    test::write_bytes(folder / "flipped.rawlog", bytes);
    auto options = test::import_options(folder / "flipped.rawlog", folder / "flipped.lcm");
    options.overwrite = true;
    const auto report = import_recording(options, {});
    if (!report) {
      // A flipped bit in a label makes a second sensor; one in the first byte makes the file unrecognizable.
      EXPECT_FALSE(report.error().message.empty());
      continue;
    }
    EXPECT_GE(report->find(channel::kScan)->kept, 215U) << "trial " << trial;
  }
}

TEST(ImportRawlog, DamagedObjectInTheMiddleIsSkipped) {
  PARHELION_NEEDS_RECORDING(test::sena_rawlog());
  TemporaryFolder folder;
  auto bytes = inflated(test::sena_rawlog());
  const std::string name = "CActionCollection";
  auto at = std::search(bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() / 2), bytes.end(),
                        name.begin(), name.end());
  ASSERT_NE(at, bytes.end());
  *at = 'X';
  test::write_bytes(folder / "damaged.rawlog", bytes);
  const auto report =
      import_recording(test::import_options(folder / "damaged.rawlog", folder / "damaged.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->find(channel::kScan)->kept, 225U);
  EXPECT_EQ(report->find(channel::kOdometry)->kept, 224U);
  EXPECT_EQ(report->refused, 1U);
}

// 200 in each run, 5,000 in the long one.
TEST(ImportSimplemap, FlippedBitsNeverCrashAndNeverFillTheMemory) {
  TemporaryFolder folder;
  pose::MappedScan mapped;
  mapped.scan.angle_min = -1;
  mapped.scan.angle_increment = 0.01F;
  mapped.scan.ranges.assign(200, 5);
  const std::string path = folder / "map.simplemap";
  ASSERT_TRUE(pose::write_simplemap(std::vector<pose::MappedScan>(5, mapped), path));
  ASSERT_EQ(pose::read_simplemap(path)->size(), 5U);
  const auto whole = inflated(path);
  std::mt19937 random(7);
  const int trials = test::long_run() ? 5000 : 200;
  int refused = 0;
  for (int trial = 0; trial < trials; ++trial) {
    auto bytes = whole;
    for (int flip = 0; flip < 3; ++flip)
      bytes[random() % bytes.size()] ^= static_cast<char>(1U << (random() % 8));
    // With a correct checksum: only the contents are wrong.
    gzFile file = gzopen(path.c_str(), "wb");
    gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size()));
    gzclose(file);
    refused += pose::read_simplemap(path) ? 0 : 1;
  }
  EXPECT_GT(refused, 0);
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  EXPECT_LT(used.ru_maxrss, 1L << 20) << "kB";
}

TEST(ImportSimplemap, AMapThatIsTooLargeIsRefusedWithItsSize) {
  TemporaryFolder folder;
  pose::MappedScan near;
  near.scan.angle_increment = 0.01F;
  near.scan.ranges.assign(20, 5);
  pose::MappedScan far = near, farther = near;
  far.T_map_base = {2000, 1000, 0};
  farther.T_map_base.x = 1e9;
  const std::string path = folder / "map.simplemap";
  ASSERT_TRUE(pose::write_simplemap(std::vector{near, far}, path));
  EXPECT_THAT(pose::read_simplemap(path).error().message, ::testing::HasSubstr("1 km^2"));
  ASSERT_TRUE(pose::write_simplemap(std::vector{near, farther}, path));
  EXPECT_THAT(pose::read_simplemap(path).error().message, ::testing::HasSubstr("scan 2 reaches farther"));
}

mrpt::obs::CObservation2DRangeScan::Ptr clockwise_scan() {
  auto scan = mrpt::obs::CObservation2DRangeScan::Create();
  scan->timestamp = mrpt::Clock::fromDouble(1e9);
  scan->aperture = 2.0F;
  scan->rightToLeft = false;
  scan->maxRange = 10;
  scan->sensorPose = mrpt::poses::CPose3D(1, 2, 3, 0.4, 0.5, 0.6);
  scan->sensorLabel = "FRONT";
  const float ranges[] = {1, 2, 12, 4, 0};
  scan->resizeScan(5);
  for (std::size_t i = 0; i < 5; ++i) {
    scan->setScanRange(i, ranges[i]);
    scan->setScanRangeValidity(i, i < 2);
  }
  return scan;
}

void write_rawlog(const std::filesystem::path& path,
                  const std::vector<mrpt::serialization::CSerializable::Ptr>& objects) {
  mrpt::io::CFileGZOutputStream file(path.string());
  auto archive = mrpt::serialization::archiveFrom(file);
  for (const auto& object : objects) archive << *object;
}

TEST(ImportRawlog, ClockwiseScansAndFlagsAreUnchanged) {
  TemporaryFolder folder;
  write_rawlog(folder / "one.rawlog", {clockwise_scan()});
  const auto report = import_recording(test::import_options(folder / "one.rawlog", folder / "one.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->find(channel::kOdometry), nullptr) << "there is no odometry in it";
  const ImportedLog log(folder / "one.lcm");
  const auto scans = log.all<Scan>(channel::kScan);
  ASSERT_EQ(scans.size(), 1U);
  EXPECT_EQ(scans[0].stamp.utime(), 1'000'000'000'000'000);
  EXPECT_FLOAT_EQ(scans[0].angle_min, 1);
  EXPECT_FLOAT_EQ(scans[0].angle_increment, -0.5F);
  EXPECT_EQ(scans[0].ranges[0], 1.0F);
  EXPECT_EQ(scans[0].ranges[2], 12.0F) << "flagged, and beyond the maximum: kept as it was written";
  EXPECT_TRUE(std::isnan(scans[0].ranges[3])) << "flagged, but looks like a range: invalid";
  EXPECT_EQ(scans[0].ranges[4], 0.0F);
  const auto laser = *log.robot().laser;
  // MRPT's order is yaw, pitch, roll.
  const Eigen::Matrix3d expected =
      (Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  EXPECT_TRUE(laser.T_base_laser.rotation().isApprox(expected, 1e-6));
  EXPECT_TRUE(laser.T_base_laser.translation().isApprox(Eigen::Vector3d(1, 2, 3), 1e-6));
}

TEST(ImportRawlog, SeveralLasersAreAnErrorThatListsThem) {
  TemporaryFolder folder;
  auto rear = clockwise_scan();
  rear->sensorLabel = "REAR";
  write_rawlog(folder / "two.rawlog", {clockwise_scan(), rear});
  auto options = test::import_options(folder / "two.rawlog", folder / "two.lcm");
  const auto refused = import_recording(options, {});
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("SCAN=FRONT"));
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("SCAN=REAR"));
  EXPECT_FALSE(std::filesystem::exists(folder / "two.lcm"));
  options.topics["SCAN"] = "REAR";
  const auto report = import_recording(options, {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->find(channel::kScan)->kept, 1U);
  EXPECT_EQ(report->left_out.at("scan FRONT"), 1U);
}

TEST(ImportRawlog, ASweptLaserIsImportedOnRequest) {
  TemporaryFolder folder;
  auto side = clockwise_scan();
  side->sensorLabel = "SIDE";
  side->sensorPose = mrpt::poses::CPose3D(0.1, 0.2, 0.3, 0, 0, 1.5);
  write_rawlog(folder / "two.rawlog", {clockwise_scan(), side});
  auto options = test::import_options(folder / "two.rawlog", folder / "two.lcm");
  options.topics["LINES"] = "SIDE";
  const auto report = import_recording(options, {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  const ImportedLog log(folder / "two.lcm");
  EXPECT_EQ(log.all<Scan>(channel::kScan).size(), 1U);
  EXPECT_EQ(log.all<Scan>(channel::kLines).size(), 1U);
  const RobotDescription robot = log.robot();
  ASSERT_TRUE(robot.line_laser);
  EXPECT_TRUE(
      robot.line_laser->laser.T_base_laser.translation().isApprox(Eigen::Vector3d(0.1, 0.2, 0.3), 1e-6));
}

TEST(ImportRawlog, AChannelThatARawlogLacksIsRefusedWithThoseItHas) {
  TemporaryFolder folder;
  write_rawlog(folder / "one.rawlog", {clockwise_scan()});
  auto options = test::import_options(folder / "one.rawlog", folder / "one.lcm");
  options.topics["IMU"] = "/imu";
  const auto refused = import_recording(options, {});
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("IMU=/imu"));
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("SCAN, LINES, ODOMETRY"));
}

TEST(ImportRawlog, ExistingOutputIsNotOverwrittenWithoutForce) {
  TemporaryFolder folder;
  write_rawlog(folder / "one.rawlog", {clockwise_scan()});
  test::write_text(folder / "one.lcm", "precious");
  auto options = test::import_options(folder / "one.rawlog", folder / "one.lcm");
  const auto refused = import_recording(options, {});
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("--force"));
  EXPECT_EQ(test::file_bytes(folder / "one.lcm").size(), 8U);
  options.overwrite = true;
  EXPECT_TRUE(import_recording(options, {}).ok());
  EXPECT_GT(test::file_bytes(folder / "one.lcm").size(), 100U);
}

}  // namespace
}  // namespace parhelion::tools
