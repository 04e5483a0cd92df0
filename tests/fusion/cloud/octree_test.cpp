// OctoMap's binary octrees.
#include <gtest/gtest.h>

#include <random>
#include <string>

#include "fusion/cloud/read_cloud.hpp"
#include "tests/fusion/cloud/octree_bytes.hpp"

namespace parhelion::cloud {
namespace {

using namespace test::octree;

TEST(Octree, OccupiedCubesAreReadAtTheirCentres) {
  const auto scan =
      parse_scan(tree(7, node({{0, kOccupied}, {1, kOccupied}, {4, kFree}})), "a.bt", ScanFormat::octree);
  ASSERT_TRUE(scan) << scan.error().message;
  ASSERT_EQ(scan->cloud.size(), 2U);
  EXPECT_TRUE(scan->cloud.points[0].isApprox(Eigen::Vector3f(0.05F, 0.05F, 0.05F), 1e-4F));
  EXPECT_TRUE(scan->cloud.points[1].isApprox(Eigen::Vector3f(0.15F, 0.05F, 0.05F), 1e-4F));
  ASSERT_TRUE(scan->spacing);
  EXPECT_DOUBLE_EQ(*scan->spacing, 0.1);
}

TEST(Octree, APrunedLeafIsItsShell) {
  std::string bytes = kHead + node({{7, kInner}});
  for (int depth = 1; depth < 14; ++depth) bytes += node({{0, kInner}});
  const auto scan = parse_scan(bytes + node({{0, kOccupied}}), "a.bt", ScanFormat::octree);
  ASSERT_TRUE(scan) << scan.error().message;
  ASSERT_EQ(scan->cloud.size(), 8U);  // two cubes a side
  for (const Eigen::Vector3f& p : scan->cloud.points)
    EXPECT_TRUE((p.array() > 0).all() && (p.array() < 0.2F).all()) << p.transpose();
}

TEST(Octree, WhatIsWrongIsNamed) {
  const auto message = [](const std::string& bytes) {
    const auto scan = parse_scan(bytes, "a.bt", ScanFormat::octree);
    return scan ? std::string("read") : scan.error().message;
  };
  EXPECT_NE(message("no tree").find("# Octomap OcTree binary file"), std::string::npos);
  EXPECT_NE(message("# Octomap OcTree binary file\nres huge\ndata\n").find("resolution"), std::string::npos);
  EXPECT_NE(message("# Octomap OcTree binary file\nid ColorOcTree\nres 0.1\ndata\n").find("OcTree"),
            std::string::npos);
  EXPECT_NE(message(kHead + node({{0, kInner}})).find("ends within the tree"), std::string::npos);
  EXPECT_NE(message(kHead).find("a.bt"), std::string::npos);  // no cube at all
}

TEST(Octree, DamagedFilesGiveACloudOrAnError) {
  std::mt19937 random(4);
  const std::string sample = tree(7, node({{0, kOccupied}, {3, kOccupied}}));
  for (int i = 0; i < 5'000; ++i) {
    std::string bytes = sample;
    for (int k = 0; k <= i % 3; ++k) bytes[random() % bytes.size()] ^= static_cast<char>(1U << random() % 8);
    const auto scan = parse_scan(bytes, "a.bt", ScanFormat::octree);
    if (!scan) continue;
    for (const Eigen::Vector3f& p : scan->cloud.points) EXPECT_TRUE(p.allFinite());
  }
}

}  // namespace
}  // namespace parhelion::cloud
