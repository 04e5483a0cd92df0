// Written clouds are read back bit for bit, in every format.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <unistd.h>

#include <fstream>

#include "fusion/cloud/read_cloud.hpp"
#include "fusion/cloud/write_cloud.hpp"

namespace parhelion::cloud {
namespace {

std::filesystem::path scratch(const char* name) {
  return std::filesystem::temp_directory_path() / ("parhelion-cloud-" + std::to_string(::getpid()) + name);
}

/// Any valid cloud, with any of the optional columns.
PointCloud<Scanner> arbitrary_cloud() {
  PointCloud<Scanner> cloud;
  const auto coordinate = rc::gen::map(rc::gen::inRange(-50'000'000, 50'000'000),
                                       [](int v) { return static_cast<float>(v) / 1'234'567.0F; });
  const auto n = static_cast<std::size_t>(*rc::gen::inRange(1, 40));
  const bool normals = *rc::gen::arbitrary<bool>(), colours = *rc::gen::arbitrary<bool>(),
             labels = *rc::gen::arbitrary<bool>(), scans = *rc::gen::arbitrary<bool>();
  const int viewpoints = scans ? 5 : *rc::gen::inRange(0, 2);
  for (std::size_t i = 0; i < n; ++i) {
    const auto vector = [&] { return Eigen::Vector3f(*coordinate, *coordinate, *coordinate); };
    cloud.points.push_back(vector());
    if (normals) cloud.normals.push_back((vector() + Eigen::Vector3f(0, 0, 100)).normalized());
    const auto byte = rc::gen::arbitrary<std::uint8_t>();
    if (colours) cloud.colours.push_back({*byte, *byte, *byte});
    if (labels) cloud.labels.push_back(*byte);
    if (scans) cloud.scans.push_back(static_cast<std::uint16_t>(*rc::gen::inRange(0, 5)));
  }
  for (int i = 0; i < viewpoints; ++i) cloud.viewpoints.emplace_back(0.1 * i + 0.3, 1.0 / 3, -i);
  return cloud;
}

void expect_same(const PointCloud<Scanner>& a, const PointCloud<Scanner>& b) {
  RC_ASSERT(a.points == b.points);
  RC_ASSERT(a.normals == b.normals);
  RC_ASSERT(a.colours == b.colours);
  RC_ASSERT(a.labels == b.labels);
  RC_ASSERT(a.scans == b.scans);
}

RC_GTEST_PROP(CloudRoundTrip, ply_keeps_every_bit_of_every_column, ()) {
  const PointCloud<Scanner> cloud = arbitrary_cloud();
  const auto path = scratch(".ply");
  RC_ASSERT(write_ply(path, cloud).ok());
  const auto read = read_scan(path);
  RC_ASSERT(read.ok());
  expect_same(read->cloud, cloud);
  RC_ASSERT(read->cloud.viewpoints == cloud.viewpoints);
  RC_ASSERT(!std::filesystem::exists(path.string() + ".part"));
  std::filesystem::remove(path);
}

RC_GTEST_PROP(CloudRoundTrip, pcd_keeps_every_bit_of_every_column_and_one_viewpoint, ()) {
  const PointCloud<Scanner> cloud = arbitrary_cloud();
  const auto path = scratch(".pcd");
  RC_ASSERT(write_pcd(path, cloud).ok());
  const auto read = read_scan(path);
  RC_ASSERT(read.ok());
  expect_same(read->cloud, cloud);
  if (cloud.viewpoints.size() == 1) RC_ASSERT(read->cloud.viewpoints == cloud.viewpoints);
  std::filesystem::remove(path);
}

TEST(WriteCloud, non_finite_or_uneven_clouds_are_refused_and_leave_no_file) {
  const auto path = scratch("-refused.ply");
  PointCloud<Map> cloud;
  cloud.points = {{0, 0, 0}, {0, std::numeric_limits<float>::quiet_NaN(), 0}};
  EXPECT_FALSE(write_ply(path, cloud));
  cloud.points.pop_back();
  cloud.labels = {1, 2};
  EXPECT_FALSE(write_pcd(path, cloud));
  cloud.labels = {};
  EXPECT_FALSE(write_ply("/nonexistent/cloud.ply", cloud));
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_FALSE(std::filesystem::exists(path.string() + ".part"));
}

}  // namespace
}  // namespace parhelion::cloud
