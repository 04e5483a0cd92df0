// LAS files: versions, point formats, colours, large coordinates, damage.
#include <gtest/gtest.h>

#include <random>
#include <string>

#include "fusion/cloud/read_cloud.hpp"
#include "tests/fusion/cloud/las_bytes.hpp"

namespace parhelion::cloud {
namespace {

using test::kLasColour;
using test::las;
using test::put;

std::string message(const std::string& bytes) {
  const auto scan = parse_scan(bytes, "a.las", ScanFormat::las);
  return scan ? "read" : scan.error().message;
}

TEST(Las, EachVersionAndPointFormatIsRead) {
  for (int minor = 0; minor <= 4; ++minor) {
    for (std::size_t format = 0; format <= 10; ++format) {
      const auto scan = parse_scan(las(minor, format), "a.las", ScanFormat::las);
      ASSERT_TRUE(scan) << minor << " " << format << " " << scan.error().message;
      ASSERT_EQ(scan->cloud.size(), 2U);
      EXPECT_TRUE(scan->cloud.points[1].isApprox(Eigen::Vector3f(-4, 5.5F, 6)));
      ASSERT_EQ(scan->cloud.colours.size(), kLasColour[format] > 0 ? 2U : 0U) << format;
      if (kLasColour[format] > 0) {
        EXPECT_EQ(scan->cloud.colours[0][0], 255);
      }
    }
  }
}

TEST(Las, ColoursWrittenAsBytesAreNotBlack) {
  const auto scan = parse_scan(las(2, 2, 0, 200), "a.las", ScanFormat::las);
  ASSERT_TRUE(scan);
  EXPECT_EQ(scan->cloud.colours[0][0], 200);
}

TEST(Las, CoordinatesOfANationalGridKeepTheirMillimetres) {
  const auto scan = parse_scan(las(2, 0, 5'403'217.25), "a.las", ScanFormat::las);
  ASSERT_TRUE(scan);
  const Eigen::Vector3f d = scan->cloud.points[1] - scan->cloud.points[0];
  EXPECT_NEAR(d.x(), -5, 1e-4);
  EXPECT_NEAR(d.y(), 3.5, 1e-4);
  ASSERT_FALSE(scan->notes.empty());
  EXPECT_NE(scan->notes[0].find("subtracted"), std::string::npos);
}

TEST(Las, WhatCannotBeReadIsNamed) {
  std::string compressed = las(2, 1);
  compressed[104] = static_cast<char>(compressed[104] | 0x80);
  EXPECT_NE(message(compressed).find("pdal translate"), std::string::npos);
  std::string version = las(2, 0);
  version[24] = 2;
  EXPECT_NE(message(version).find("LAS 1.0 to 1.4"), std::string::npos);
  std::string many = las(2, 0);
  put<std::uint32_t>(many, 107, 4'000'000'000U);
  EXPECT_NE(message(many).find("declares 4000000000 points"), std::string::npos);
  std::string flat = las(2, 0);
  put<double>(flat, 131, 0);
  EXPECT_NE(message(flat).find("scale"), std::string::npos);
}

TEST(Las, EachTruncationIsAnError) {
  const std::string bytes = las(4, 7);
  for (std::size_t n = 0; n < bytes.size(); ++n) EXPECT_NE(message(bytes.substr(0, n)), "read") << n;
}

TEST(Las, DamagedFilesGiveACloudOrAnError) {
  std::mt19937 random(3);
  for (int i = 0; i < 20'000; ++i) {
    std::string bytes = las(i % 5, static_cast<std::size_t>(i) % 11);
    for (int k = 0; k <= i % 4; ++k) bytes[random() % bytes.size()] ^= static_cast<char>(1U << random() % 8);
    const auto scan = parse_scan(bytes, "a.las", ScanFormat::las);
    if (!scan) continue;
    EXPECT_LE(scan->cloud.size(), bytes.size());
    for (const Eigen::Vector3f& p : scan->cloud.points) EXPECT_TRUE(p.allFinite());
  }
}

}  // namespace
}  // namespace parhelion::cloud
