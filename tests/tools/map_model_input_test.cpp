// Clouds that `map model` refuses, each with the fault and its remedy.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

#include "fusion/cloud/write_cloud.hpp"
#include "fusion/semantic/build_model.hpp"
#include "protocols/model.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/synthetic_site.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::tools {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class MapModelInput : public ::testing::Test {
 protected:
  std::string write(const cloud::PointCloud<Cloud>& cloud) {
    EXPECT_TRUE(cloud::write_ply(folder_ / "cloud.ply", cloud).ok());
    return folder_ / "cloud.ply";
  }
  /// A PLY with three floats per point; `body` may be shorter than the header states.
  std::string write_raw(std::uint64_t points, const std::vector<float>& body) {
    std::ofstream file(folder_ / "cloud.ply", std::ios::binary);
    file << "ply\nformat binary_little_endian 1.0\nelement vertex " << points
         << "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    file.write(reinterpret_cast<const char*>(body.data()), static_cast<std::streamsize>(4 * body.size()));
    return folder_ / "cloud.ply";
  }
  test::Ran model(const std::string& cloud, std::vector<std::string> more = {}) {
    std::vector<std::string> words = {"map", "model", cloud, "-o", folder_ / "model.yaml", "--force"};
    words.insert(words.end(), more.begin(), more.end());
    return test::run(words, folder_ / "log.txt");
  }
  void expect_refused(const test::Ran& ran, const ::testing::Matcher<const std::string&>& expected) {
    EXPECT_EQ(ran.exit, 1) << ran.output;
    EXPECT_THAT(ran.output, expected);
    EXPECT_THAT(ran.output, HasSubstr("parhelion map model: "));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "model.yaml"));
  }
  const test::TemporaryFolder folder_;
};

/// Points on a rectangle around `centre` with half sides `u` and `v`, and 4 mm of noise along `w`.
cloud::PointCloud<Cloud> plane(const Eigen::Vector3d& centre, const Eigen::Vector3d& u,
                               const Eigen::Vector3d& v, const Eigen::Vector3d& w) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> along(-1, 1);
  std::normal_distribution<double> noise(0, 0.004);
  cloud::PointCloud<Cloud> cloud;
  for (int i = 0; i < 40'000; ++i)
    cloud.points.push_back(
        (centre + along(random) * u + along(random) * v + noise(random) * w).cast<float>());
  return cloud;
}

const Eigen::Vector3d kX = Eigen::Vector3d::UnitX(), kY = Eigen::Vector3d::UnitY(),
                      kZ = Eigen::Vector3d::UnitZ();

TEST_F(MapModelInput, ACloudWithoutPoints) {
  expect_refused(model(write_raw(0, {})), AllOf(HasSubstr("cloud.ply"), HasSubstr("no points")));
}

TEST_F(MapModelInput, OnlyNaN) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  expect_refused(model(write_raw(500, std::vector<float>(1500, nan))), HasSubstr("all 500 are NaN"));
}

TEST_F(MapModelInput, MillimetresGivenAsMetres) {
  cloud::PointCloud<Cloud> cloud = test::scan_of_site(0.02);
  for (Eigen::Vector3f& p : cloud.points) p *= 1000;
  for (Eigen::Vector3d& p : cloud.viewpoints) p *= 1000;
  const std::string path = write(cloud);
  expect_refused(model(path), AllOf(HasSubstr("the room is 2610 m high"), HasSubstr("--unit mm")));
  EXPECT_EQ(model(path, {"--unit", "mm"}).exit, 0);
}

TEST_F(MapModelInput, UpsideDown) {
  cloud::PointCloud<Cloud> cloud = test::scan_of_site();
  for (Eigen::Vector3f& p : cloud.points) p = Eigen::Vector3f(p.x(), -p.y(), -p.z());
  for (Eigen::Vector3d& p : cloud.viewpoints) p = Eigen::Vector3d(p.x(), -p.y(), -p.z());
  const std::string path = write(cloud);
  expect_refused(model(path), AllOf(HasSubstr("upside down"), HasSubstr("--flip")));
  ASSERT_EQ(model(path, {"--flip"}).exit, 0);
  const auto turned = load_model(folder_ / "model.yaml");
  ASSERT_TRUE(turned) << turned.error().message;
  const auto floor = semantic::ground_floor(*turned);
  ASSERT_TRUE(floor);
  for (const ModelEntity& entity : turned->entities) {
    const double height = entity.T_map_body.translation().z() - *floor;
    if (entity.label == EntityLabel::ceiling) {
      EXPECT_NEAR(height, 2.65, 0.05);
    } else if (entity.label == EntityLabel::wall_above_door) {
      EXPECT_GT(height, 2.1);
    }
  }
}

TEST_F(MapModelInput, ASinglePlane) {
  expect_refused(model(write(plane({0, 2, 1.2}, 3 * kX, 1.2 * kZ, kY))), HasSubstr("no level surface"));
  // A floor alone is a small model, but it contains nothing that a laser could hit.
  const std::string floor = write(plane({0, 0, 0}, 3 * kX, 2 * kY, kZ));
  expect_refused(model(floor, {"--slice", folder_ / "slice"}), HasSubstr("no surface at the laser's height"));
  ASSERT_EQ(model(floor).exit, 0);
  const auto made = load_model(folder_ / "model.yaml");
  ASSERT_TRUE(made) << made.error().message;
  for (const ModelEntity& entity : made->entities) EXPECT_EQ(entity.label, EntityLabel::floor);
}

TEST_F(MapModelInput, OneRepeatedPoint) {
  cloud::PointCloud<Cloud> cloud;
  cloud.points.assign(40'000, {1, 2, 3});
  expect_refused(model(write(cloud)), HasSubstr("no level surface"));
}

/// A sparse file: its length is as stated, but it occupies no disk space.
TEST_F(MapModelInput, TooManyPointsAreRefusedBeforeReading) {
  const std::string path = write_raw(100'000'000, {});
  std::filesystem::resize_file(path, std::filesystem::file_size(path) + 1'200'000'000);
  expect_refused(model(path, {"--memory", "2"}),
                 AllOf(HasSubstr("100000000 points needs 4.80 GB"), HasSubstr("2.00 GB are available")));
  // A limit of the process counts as missing memory.
  const std::string limited = "ulimit -v 3000000; exec '" + test::program() + "' map model '" + path +
                              "' -o '" + (folder_ / "model.yaml") + "'";
  expect_refused(test::run({"-c", limited}, folder_ / "log.txt", "/bin/sh"), HasSubstr("4.80 GB of memory"));
}

}  // namespace
}  // namespace parhelion::tools
