#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "protocols/quantile.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/imported_log.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::tools {
namespace {

using test::ImportedLog;
using test::TemporaryFolder;

std::filesystem::path kitchen() { return test::recording("rgbd-7scenes-redkitchen-a"); }

cv::Mat depth_of(const Image& image) { return cv::imdecode(image.bytes, cv::IMREAD_UNCHANGED); }

Eigen::Vector3d point(const CameraIntrinsics& camera, double column, double row, double z) {
  return {(column - camera.cx) / camera.fx * z, (row - camera.cy) / camera.fy * z, z};
}

/// The kitchen, imported once for all tests.
const ImportedLog& kitchen_log() {
  static const ImportedLog log = [] {
    TemporaryFolder folder;
    const auto report = import_recording(test::import_options(kitchen(), folder / "kitchen.lcm"), {});
    EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
    return ImportedLog(folder / "kitchen.lcm");
  }();
  return log;
}

TEST(ImportRgbd, EveryFrameGivesPoseImagesAndScan) {
  PARHELION_NEEDS_RECORDING(kitchen());
  const ImportedLog& log = kitchen_log();
  log.expect_arrivals_increase();
  const auto poses = log.all<PoseEstimate>(channel::kPoseCov);
  const auto colour = log.all<Image>(channel::kCamera), depth = log.all<Image>(channel::kDepth);
  const auto scans = log.all<Scan>(channel::kScan);
  ASSERT_EQ(poses.size(), 100U);
  ASSERT_EQ(colour.size(), 100U);
  ASSERT_EQ(depth.size(), 100U);
  ASSERT_EQ(scans.size(), 100U);
  for (std::size_t i = 0; i < 100; ++i) {
    EXPECT_EQ(poses[i].stamp, colour[i].stamp);
    EXPECT_EQ(poses[i].stamp, depth[i].stamp);
    EXPECT_EQ(poses[i].stamp, scans[i].stamp);
  }
  EXPECT_NEAR((poses[1].stamp - poses[0].stamp).seconds(), 2.0 / 30, 2e-6) << "every second frame is there";
  EXPECT_EQ(poses[0].state, SlamState::tracking);
  EXPECT_TRUE(poses[0].causal);
  EXPECT_NEAR(poses[0].covariance(0, 0), 1e-4, 1e-9);
  EXPECT_FALSE(poses[0].map_id.empty());
}

TEST(ImportRgbd, ColourImagesAreCopiedByteForByte) {
  PARHELION_NEEDS_RECORDING(kitchen());
  const auto colour = kitchen_log().all<Image>(channel::kCamera);
  const auto file = test::file_bytes(kitchen() / "frame-000004.color.jpg");
  EXPECT_EQ(colour[2].bytes, std::vector<std::uint8_t>(file.begin(), file.end()));
  EXPECT_EQ(colour[2].format, PixelFormat::mjpeg);
  EXPECT_EQ(colour[2].width, 640);
  EXPECT_EQ(colour[2].height, 480);
}

/// Least-squares fit of z over x and y.
class Plane {
 public:
  void add(const Eigen::Vector3d& p) {
    const Eigen::Vector3d at(p.x(), p.y(), 1);
    products_ += at * at.transpose();
    right_side_ += at * p.z();
  }
  double slope_degrees() const {
    return Eigen::Vector3d(products_.ldlt().solve(right_side_)).head<2>().norm() * 180 / M_PI;
  }

 private:
  Eigen::Matrix3d products_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_side_ = Eigen::Vector3d::Zero();
};

TEST(ImportRgbd, FloorIsFlatAtZeroAndTheTableAbove) {
  PARHELION_NEEDS_RECORDING(kitchen());
  const ImportedLog& log = kitchen_log();
  const auto poses = log.all<PoseEstimate>(channel::kPoseCov);
  const auto depth = log.all<Image>(channel::kDepth);
  const DepthCameraDescription camera = *log.robot().depth;
  std::vector<double> floor, below;
  std::size_t points = 0, table = 0;
  Plane floor_plane, table_plane;
  for (std::size_t i = 0; i < poses.size(); i += 10) {
    const cv::Mat mm = depth_of(depth[i]);
    const auto T_map_optical = poses[i].T_map_base * camera.T_base_optical;
    for (int row = 0; row < mm.rows; row += 4) {
      for (int column = 0; column < mm.cols; column += 4) {
        const double z = mm.at<std::uint16_t>(row, column) * 1e-3;
        if (z == 0) continue;
        const Eigen::Vector3d p = T_map_optical * point(camera.intrinsics, column, row, z);
        ++points;
        if (p.z() < -0.1) below.push_back(p.z());
        if (std::abs(p.z() - 0.72) < 0.05) {
          ++table;
          table_plane.add(p);
        }
        if (std::abs(p.z()) > 0.06) continue;
        floor.push_back(p.z());
        floor_plane.add(p);
      }
    }
  }
  ASSERT_GT(floor.size(), 1000U);
  const double slope = floor_plane.slope_degrees(), table_slope = table_plane.slope_degrees();
  std::printf(
      "floor: %zu points, median %.4f m, slope %.2f degrees; below it %.3f %%; table top %.1f %%, slope "
      "%.2f\n",
      floor.size(), median(floor), slope, 100.0 * below.size() / points, 100.0 * table / points, table_slope);
  EXPECT_LT(std::abs(median(floor)), 0.015);
  EXPECT_LT(slope, 0.5);
  EXPECT_LT(table_slope, 0.6) << "the floor alone decided what is level; the table agrees";
  EXPECT_LT(below.size(), points / 100);
  EXPECT_GT(table, points / 20) << "the table stands 0.72 m high";
}

TEST(ImportRgbd, DepthIsConsistentBetweenFrames) {
  PARHELION_NEEDS_RECORDING(kitchen());
  const ImportedLog& log = kitchen_log();
  const auto poses = log.all<PoseEstimate>(channel::kPoseCov);
  const auto depth = log.all<Image>(channel::kDepth);
  const DepthCameraDescription camera = *log.robot().depth;
  std::vector<double> differences;
  for (std::size_t i = 0; i + 20 < poses.size(); i += 20) {
    const cv::Mat from = depth_of(depth[i]), to = depth_of(depth[i + 20]);
    const auto T_to_from = (poses[i + 20].T_map_base * camera.T_base_optical).inverse() *
                           (poses[i].T_map_base * camera.T_base_optical);
    for (int row = 0; row < from.rows; row += 8) {
      for (int column = 0; column < from.cols; column += 8) {
        const double z = from.at<std::uint16_t>(row, column) * 1e-3;
        if (z == 0) continue;
        const Eigen::Vector3d p = T_to_from * point(camera.intrinsics, column, row, z);
        if (p.z() <= 0) continue;
        const int u =
            static_cast<int>(std::lround(camera.intrinsics.fx * p.x() / p.z() + camera.intrinsics.cx));
        const int v =
            static_cast<int>(std::lround(camera.intrinsics.fy * p.y() / p.z() + camera.intrinsics.cy));
        if (u < 0 || v < 0 || u >= to.cols || v >= to.rows || to.at<std::uint16_t>(v, u) == 0) continue;
        differences.push_back(std::abs(p.z() - to.at<std::uint16_t>(v, u) * 1e-3));
      }
    }
  }
  ASSERT_GT(differences.size(), 5000U);
  std::printf("depth 40 frames apart differs by a median of %.4f m\n", median(differences));
  EXPECT_LT(median(differences), 0.035);
}

/// Mean colour gradient at depth edges, projected with the calibration of the description, or 1:1.
double gradient_at_depth_edges(const ImportedLog& log, bool registered) {
  const auto colour = log.all<Image>(channel::kCamera), depth = log.all<Image>(channel::kDepth);
  const RobotDescription robot = log.robot();
  const auto& from = robot.depth->intrinsics;
  const auto& to = robot.camera->intrinsics;
  const Eigen::Isometry3d T_colour_depth =
      (robot.camera->T_base_optical.inverse() * robot.depth->T_base_optical).isometry();
  double sum = 0;
  std::size_t n = 0;
  for (std::size_t i = 0; i < colour.size(); i += 20) {
    cv::Mat grey = cv::imdecode(colour[i].bytes, cv::IMREAD_GRAYSCALE), dx, dy, gradient;
    cv::Sobel(grey, dx, CV_32F, 1, 0);
    cv::Sobel(grey, dy, CV_32F, 0, 1);
    cv::magnitude(dx, dy, gradient);
    const cv::Mat mm = depth_of(depth[i]);
    for (int row = 2; row + 2 < mm.rows; ++row) {
      for (int column = 2; column + 2 < mm.cols; ++column) {
        const int here = mm.at<std::uint16_t>(row, column), beside = mm.at<std::uint16_t>(row, column + 1);
        // Only edges with the nearer side on the right: a Kinect has no shadow there.
        if (here == 0 || beside - here < 100) continue;
        Eigen::Vector3d p = point(from, column, row, here * 1e-3);
        const auto& camera = registered ? to : from;
        if (registered) p = T_colour_depth * p;
        const int u = static_cast<int>(std::lround(camera.fx * p.x() / p.z() + camera.cx));
        const int v = static_cast<int>(std::lround(camera.fy * p.y() / p.z() + camera.cy));
        if (u < 0 || v < 0 || u >= gradient.cols || v >= gradient.rows) continue;
        sum += gradient.at<float>(v, u);
        ++n;
      }
    }
  }
  return sum / static_cast<double>(n);
}

TEST(ImportRgbd, DepthEdgesAlignWithColourEdges) {
  PARHELION_NEEDS_RECORDING(kitchen());
  const RobotDescription robot = kitchen_log().robot();
  EXPECT_EQ(robot.camera->intrinsics.fx, 525);
  EXPECT_EQ(robot.depth->intrinsics.fx, 585);
  const double laid = gradient_at_depth_edges(kitchen_log(), true),
               overlaid = gradient_at_depth_edges(kitchen_log(), false);
  std::printf("mean colour gradient at depth edges: %.0f through the cameras, %.0f overlaid 1:1\n", laid,
              overlaid);
  EXPECT_GT(laid, 2 * overlaid);
}

TEST(ImportRgbd, ScanIsTheDepthWithinTheHeightBand) {
  PARHELION_NEEDS_RECORDING(kitchen());
  const ImportedLog& log = kitchen_log();
  const RobotDescription robot = log.robot();
  EXPECT_THAT(robot.laser->source, ::testing::StartsWith("derived: no laser"));
  const auto poses = log.all<PoseEstimate>(channel::kPoseCov);
  const auto depth = log.all<Image>(channel::kDepth);
  const auto scans = log.all<Scan>(channel::kScan);
  std::size_t hits = 0;
  for (std::size_t i = 0; i < scans.size(); i += 25) {
    // All points of the band, in level coordinates around the base.
    const cv::Mat mm = depth_of(depth[i]);
    const auto T_map_optical = poses[i].T_map_base * robot.depth->T_base_optical;
    std::vector<Eigen::Vector2d> band;
    for (int row = 0; row < mm.rows; ++row) {
      for (int column = 0; column < mm.cols; ++column) {
        const double z = mm.at<std::uint16_t>(row, column) * 1e-3;
        if (z == 0) continue;
        const Eigen::Vector3d p = T_map_optical * point(robot.depth->intrinsics, column, row, z);
        if (p.z() >= 0.2 && p.z() <= 0.5) band.push_back(p.head<2>());
      }
    }
    const auto level =
        Transform<Map, Laser>::planar(poses[i].T_map_base.translation().x(),
                                      poses[i].T_map_base.translation().y(), poses[i].T_map_base.yaw());
    const auto found = test::hits(scans[i], robot.laser->convention, level, 10);
    hits += found.size();
    for (const Eigen::Vector2d& hit : found) {
      double nearest = 1;
      for (const Eigen::Vector2d& p : band) nearest = std::min(nearest, (p - hit).norm());
      // Half a beam's width sideways.
      EXPECT_LT(nearest, 0.02);
    }
  }
  EXPECT_GT(hits, 100U);
}

/// Depth of a floor 1 m under a camera that looks down by `pitch`, and of a wall `wall` m ahead.
cv::Mat floor_and_wall(double pitch, double wall, double units) {
  cv::Mat depth(480, 640, CV_16UC1);
  for (int row = 0; row < depth.rows; ++row) {
    for (int column = 0; column < depth.cols; ++column) {
      const double y = (row - 239.5) / 525;
      const double down = std::sin(pitch) + y * std::cos(pitch),
                   ahead = std::cos(pitch) - y * std::sin(pitch);
      double z = ahead > 0 ? wall / ahead : 60;
      if (down > 0) z = std::min(z, 1 / down);
      depth.at<std::uint16_t>(row, column) =
          z < 10 ? static_cast<std::uint16_t>(std::lround(z * units)) : std::uint16_t{0};
    }
  }
  return depth;
}

/// A line of groundtruth.txt without its stamp: x ahead, y, 3 m over the world's origin. Optical axes: z
/// ahead and down by the pitch, x to the right, in a world with z up.
std::string tum_pose(double pitch) {
  Eigen::Matrix3d R;
  R.col(0) = Eigen::Vector3d(0, -1, 0);
  R.col(2) = Eigen::Vector3d(std::cos(pitch), 0, -std::sin(pitch));
  R.col(1) = R.col(2).cross(R.col(0));
  const Eigen::Quaterniond q(R);
  char text[200];
  std::snprintf(text, sizeof text, "0.5 0.25 3 %.9f %.9f %.9f %.9f\n", q.x(), q.y(), q.z(), q.w());
  return text;
}

TEST(ImportRgbd, TumLayoutGivesCorrectFloorAndWall) {
  TemporaryFolder folder;
  const std::filesystem::path place = folder / "tum";
  std::filesystem::create_directories(place / "depth");
  const double pitch = 0.4;
  cv::imwrite((place / "depth" / "1.png").string(), floor_and_wall(pitch, 2, 5000));
  test::write_text(place / "depth.txt", "# depth maps\n1305031102.160407 depth/1.png\n");
  test::write_text(place / "groundtruth.txt", "1305031102.160407 " + tum_pose(pitch));
  const auto report = import_recording(test::import_options(place, folder / "tum.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->refused, 0U);
  const ImportedLog log(folder / "tum.lcm");
  const RobotDescription robot = log.robot();
  const auto pose = log.all<PoseEstimate>(channel::kPoseCov).at(0);
  EXPECT_EQ(pose.stamp.utime(), 1305031102160407);
  const auto T_map_optical = pose.T_map_base * robot.depth->T_base_optical;
  EXPECT_NEAR(T_map_optical.translation().z(), 1, 0.002) << "the camera is 1 m over the floor";
  EXPECT_NEAR(pose.T_map_base.translation().z(), 0, 0.002) << "base_link is on the floor";
  EXPECT_NEAR(pose.T_map_base.rotation()(2, 2), 1, 1e-6) << "and level";
  const Scan scan = log.all<Scan>(channel::kScan).at(0);
  const auto middle = scan.ranges.at(scan.ranges.size() / 2);
  EXPECT_NEAR(middle, 2, 0.005);
  const double angle = scan.angle_min + 20 * scan.angle_increment;
  EXPECT_NEAR(scan.ranges.at(20) * std::cos(angle), 2, 0.01) << "a straight wall";
  const auto depth = log.all<Image>(channel::kDepth).at(0);
  EXPECT_NEAR(depth_of(depth).at<std::uint16_t>(240, 320), 1000 * 2 / std::cos(pitch), 3)
      << "millimetres on the wire";
}

TEST(ImportRgbd, StairsAreUprightWithoutAGravityFile) {
  const auto stairs = test::recording("rgbd-7scenes-stairs/seq-02");
  PARHELION_NEEDS_RECORDING(stairs);
  TemporaryFolder folder;
  const auto report = import_recording(test::import_options(stairs, folder / "stairs.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  const ImportedLog log(folder / "stairs.lcm");
  const auto poses = log.all<PoseEstimate>(channel::kPoseCov);
  ASSERT_EQ(poses.size(), 3U);
  const RobotDescription robot = log.robot();
  EXPECT_EQ(robot.camera->intrinsics.fx, 525) << "kapture's files are one folder up";
  // Treads are level: horizontal surface piles up at a few heights.
  const cv::Mat mm = depth_of(log.all<Image>(channel::kDepth)[0]);
  const auto T_map_optical = poses[0].T_map_base * robot.depth->T_base_optical;
  std::map<long, int> layers;
  int points = 0;
  for (int row = 0; row < mm.rows; row += 2) {
    for (int column = 0; column < mm.cols; column += 2) {
      const double z = mm.at<std::uint16_t>(row, column) * 1e-3;
      if (z == 0) continue;
      ++points;
      ++layers[std::lround((T_map_optical * point(robot.depth->intrinsics, column, row, z)).z() / 0.02)];
    }
  }
  int densest = 0;
  for (const auto& [layer, count] : layers) densest = std::max(densest, count);
  EXPECT_GT(densest, points / 20);
}

TEST(ImportRgbd, OmittedStreamsAreNeitherWrittenNorDescribed) {
  const auto stairs = test::recording("rgbd-7scenes-stairs/seq-01");
  PARHELION_NEEDS_RECORDING(stairs);
  TemporaryFolder folder;
  const auto imported = [&](const std::map<std::string, std::string>& topics) {
    ImportOptions options = test::import_options(stairs, folder / "stairs.lcm");
    options.topics = topics;
    options.overwrite = true;
    return import_recording(options, {});
  };
  auto report = imported({{"DEPTH", "none"}, {"REFERENCE_POSE", "none"}});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->find(channel::kDepth), nullptr);
  EXPECT_EQ(report->find(channel::kReferencePose), nullptr);
  EXPECT_EQ(report->find(channel::kScan)->kept, 3U) << "it is cut out of depth that is not written";
  EXPECT_EQ(report->find(channel::kCamera)->kept, 3U);
  EXPECT_FALSE(ImportedLog(folder / "stairs.lcm").robot().depth.has_value());
  report = imported({{"SCAN", "none"}, {"CAMERA", "none"}});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->find(channel::kScan), nullptr);
  EXPECT_EQ(report->find(channel::kCamera), nullptr);
  EXPECT_EQ(report->find(channel::kDepth)->kept, 3U);
  const RobotDescription robot = ImportedLog(folder / "stairs.lcm").robot();
  EXPECT_FALSE(robot.laser.has_value());
  EXPECT_FALSE(robot.camera.has_value());
  EXPECT_TRUE(robot.depth.has_value());
  report = imported({{"DEPTH", "/camera/depth"}});
  ASSERT_FALSE(report.ok()) << "a folder has no topics";
  EXPECT_THAT(report.error().message, ::testing::HasSubstr("DEPTH=/camera/depth"));
  EXPECT_FALSE(imported({{"ODOMETRY", "/odom"}}).ok());
  EXPECT_TRUE(imported({{"ODOMETRY", "none"}}).ok());
}

TEST(ImportRgbd, DamagedFilesAreRefusedWithTheirName) {
  PARHELION_NEEDS_RECORDING(kitchen());
  TemporaryFolder folder;
  const std::filesystem::path place = folder / "damaged";
  std::filesystem::create_directories(place);
  for (const char* name : {"camera-intrinsics.txt", "gravity-direction.txt"}) {
    std::filesystem::copy(kitchen() / name, place / name);
  }
  for (int i = 0; i < 12; i += 2) {
    for (const char* kind : {"color.jpg", "depth.png", "pose.txt"}) {
      char name[64];
      std::snprintf(name, sizeof name, "frame-%06d.%s", i, kind);
      std::filesystem::copy(kitchen() / name, place / name);
    }
  }
  auto png = test::file_bytes(place / "frame-000002.depth.png");
  png.resize(png.size() / 2);
  std::filesystem::permissions(place / "frame-000002.depth.png", std::filesystem::perms::owner_all);
  test::write_bytes(place / "frame-000002.depth.png", {png.begin(), png.begin() + 20});
  std::filesystem::permissions(place / "frame-000004.pose.txt", std::filesystem::perms::owner_all);
  test::write_text(place / "frame-000004.pose.txt", "1 0 0 0\n0 1 0 nan\n");
  std::filesystem::permissions(place / "frame-000006.color.jpg", std::filesystem::perms::owner_all);
  test::write_text(place / "frame-000006.color.jpg", "not a picture");
  const auto report = import_recording(test::import_options(place, folder / "damaged.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->refused, 3U);
  EXPECT_EQ(report->damaged, 3U);
  std::string all;
  for (const Refusal& refusal : report->refusals) all += refusal.place + " " + refusal.why + "\n";
  EXPECT_THAT(all, ::testing::HasSubstr("frame-000002.depth.png"));
  EXPECT_THAT(all, ::testing::HasSubstr("frame-000004.pose.txt"));
  EXPECT_THAT(all, ::testing::HasSubstr("frame-000006.color.jpg"));
  EXPECT_EQ(report->find(channel::kPoseCov)->kept, 5U);
  EXPECT_EQ(test::run({"import", place, "-o", folder / "run.lcm"}, folder / "said.txt").exit, 1);
  EXPECT_TRUE(std::filesystem::exists(folder / "run.lcm")) << "what could be read";
}

/// Wherever the file of an image ends, it is refused by its name, and the others are kept.
TEST(ImportRgbd, ACutImageIsDamageAndIsNotPassedOn) {
  PARHELION_NEEDS_RECORDING(kitchen());
  TemporaryFolder folder;
  const std::filesystem::path place = folder / "cut";
  std::filesystem::create_directories(place);
  for (const char* name : {"camera-intrinsics.txt", "gravity-direction.txt", "frame-000000.color.jpg",
                           "frame-000000.depth.png", "frame-000000.pose.txt", "frame-000002.color.jpg",
                           "frame-000002.depth.png", "frame-000002.pose.txt"}) {
    std::filesystem::copy(kitchen() / name, place / name);
    std::filesystem::permissions(place / name, std::filesystem::perms::owner_all);
  }
  auto options = test::import_options(place, folder / "cut.lcm");
  options.overwrite = true;
  const auto imported = [&] {
    auto report = import_recording(options, {});
    EXPECT_TRUE(report.ok()) << report.error().message;
    return report ? *report : ImportReport{};
  };
  EXPECT_EQ(imported().damaged, 0U);
  for (const auto& [name, channel] :
       {std::pair{"frame-000002.color.jpg", channel::kCamera}, {"frame-000002.depth.png", channel::kDepth}}) {
    const auto whole = test::file_bytes(place / name);
    for (const std::size_t left : {std::size_t{0}, std::size_t{3}, whole.size() / 10, whole.size() / 2,
                                   whole.size() - 20, whole.size() - 1}) {
      test::write_bytes(place / name, {whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(left)});
      const ImportReport report = imported();
      EXPECT_EQ(report.damaged, 1U) << name << left;
      ASSERT_EQ(report.refusals.size(), 1U);
      EXPECT_THAT(report.refusals[0].why, ::testing::HasSubstr(name));
      EXPECT_EQ(report.find(channel)->kept, 1U) << name << left;
    }
    test::write_bytes(place / name, whole);
  }
}

TEST(ImportRgbd, CutLinesOfListsAreDamageAndRepeatedStampsAreNot) {
  TemporaryFolder folder;
  const std::filesystem::path place = folder / "tum";
  std::filesystem::create_directories(place / "depth");
  for (const char* name : {"1.png", "2.png"})
    cv::imwrite((place / "depth" / name).string(), floor_and_wall(0.4, 2, 5000));
  const std::string list = "1305031102.16 depth/1.png\n1305031102.26 depth/2.png\n",
                    truth = "1305031102.16 " + tum_pose(0.4) + "1305031102.26 " + tum_pose(0.4);
  auto options = test::import_options(place, folder / "tum.lcm");
  options.overwrite = true;
  const auto damaged = [&](const std::string& depth, const std::string& poses) {
    test::write_text(place / "depth.txt", depth);
    test::write_text(place / "groundtruth.txt", poses);
    const auto report = import_recording(options, {});
    EXPECT_TRUE(report.ok()) << report.error().message;
    return report ? report->damaged : 99;
  };
  EXPECT_EQ(damaged(list, truth), 0U);
  EXPECT_EQ(damaged(list.substr(0, list.size() - 3), truth), 1U) << "an image that is not there";
  EXPECT_EQ(damaged(list.substr(0, list.size() - 13), truth), 1U) << "a stamp alone";
  EXPECT_EQ(damaged(list, truth.substr(0, truth.size() - 14)), 1U);
  EXPECT_EQ(damaged(list + list, truth + "1305031102.36 nan nan nan nan nan nan nan\n"), 0U) << "complete";
}

}  // namespace
}  // namespace parhelion::tools
