// Rooms with a mirror: their images behind it are no rooms.
#include "fusion/semantic/mirror_images.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>

#include "fusion/semantic/build_model.hpp"
#include "fusion/semantic/mirror_planes.hpp"
#include "fusion/semantic/model_quality.hpp"
#include "tests/fusion/semantic/clouds.hpp"

namespace parhelion::semantic {
namespace {

using testing::Contains;
using testing::HasSubstr;

constexpr double kMirror = 6;  // m, x of the plane of the wall that it hangs on
const Eigen::AlignedBox3d kGlass(Eigen::Vector3d(kMirror - 0.01, 1, 0.3),
                                 Eigen::Vector3d(kMirror + 0.01, 4, 2.2));

/// A furnished room of 6 by 5 m before the plane x = kMirror.
test::CloudSampler furnished_room(std::uint64_t seed, double density) {
  test::CloudSampler sampler(density, 0.004, seed);
  sampler.room({0, 0}, {kMirror, 5}, 0, 2.7);
  for (const double x : {1.0, 2.7, 4.1}) {
    sampler.slab({x, 0.8}, {x + 0.5, 1.3}, 0.45);
    sampler.wall({x, 1.3}, {x + 0.5, 1.32}, 0.45, 0.9);
    sampler.wall({x + 0.1, 0.8}, {x + 0.1, 1.3}, 0, 0.45);
  }
  sampler.slab({2, 3.2}, {3.6, 4}, 0.74);
  sampler.wall({2, 3.2}, {2, 4}, 0, 0.74);
  sampler.wall({3.6, 3.2}, {3.6, 4}, 0, 0.74);
  sampler.wall({0.5, 3}, {0.5, 4.2}, 0, 1.9);
  sampler.wall({0, 3}, {0.5, 3}, 0, 1.9);
  return sampler;
}

struct MirroredRoom {
  cloud::PointCloud<Cloud> cloud;
  std::vector<bool> is_image;

  void add(const Eigen::Vector3d& p, std::size_t scan, bool image) {
    cloud.points.push_back(p.cast<float>());
    cloud.scans.push_back(static_cast<std::uint16_t>(scan));
    is_image.push_back(image);
  }
};

/// The room, scanned from two places, and what they see in the mirror: `seen` of that.
MirroredRoom mirrored_room(std::uint64_t seed, double seen, double density = 500) {
  MirroredRoom room;
  room.cloud.viewpoints = {{1.5, 2.2, 1.5}, {4.4, 2.6, 1.5}};
  test::CloudSampler sampler = furnished_room(seed, density);
  for (const Eigen::Vector3f& point : sampler.cloud().points) {
    const Eigen::Vector3d p = point.cast<double>();
    const bool of_glass = p.x() > kMirror - 0.05 && p.y() > kGlass.min().y() && p.y() < kGlass.max().y() &&
                          p.z() > kGlass.min().z() && p.z() < kGlass.max().z();
    if (!of_glass) room.add(p, sampler.uniform() < 0.5 ? 0 : 1, false);
    const std::size_t scan = sampler.uniform() < 0.5 ? 0 : 1;
    const Eigen::Vector3d image(2 * kMirror - p.x(), p.y(), p.z()), &from = room.cloud.viewpoints[scan];
    const Eigen::Vector3d at = from + (kMirror - from.x()) / (image.x() - from.x()) * (image - from);
    if (!of_glass && kGlass.contains(at) && sampler.uniform() < seen) room.add(image, scan, true);
  }
  return room;
}

double fraction(const std::vector<bool>& marked, const std::vector<bool>& of, bool which) {
  int all = 0, both = 0;
  for (std::size_t i = 0; i < of.size(); ++i) {
    if (of[i] == which) ++all, both += !marked.empty() && marked[i] ? 1 : 0;
  }
  return static_cast<double>(both) / std::max(all, 1);
}

double farthest_wall(const BuiltModel& built) {
  double farthest = 0;
  for (const ModelEntity& e : built.model.entities) {
    if (e.label != EntityLabel::wall) continue;
    const Eigen::Vector3d half = 0.5 * e.size.x() * e.T_map_body.rotation().col(0);
    for (const double side : {-1.0, 1.0})
      farthest = std::max(farthest, (e.T_map_body.translation() + side * half).x());
  }
  return farthest;
}

bool doubts_images(const ModelQuality& quality) {
  return std::any_of(quality.doubts.begin(), quality.doubts.end(), [](const ModelDoubt& doubt) {
    return doubt.reason.find("image in a mirror") != std::string::npos;
  });
}

class MirrorImages : public testing::TestWithParam<std::uint64_t> {};

TEST_P(MirrorImages, AreLeftOutByTheirRays) {
  const MirroredRoom room = mirrored_room(GetParam(), 0.3);
  const auto built = build_model(room.cloud);
  ASSERT_TRUE(built) << built.error().message;
  ASSERT_EQ(built->mirrors.size(), 1U);
  EXPECT_TRUE(built->mirrors[0].rays);
  EXPECT_NEAR(std::abs(built->mirrors[0].at.x()), kMirror, 0.02);
  EXPECT_NEAR(built->mirrors[0].to - built->mirrors[0].from, kGlass.sizes().y(), 0.2);
  EXPECT_GT(fraction(built->left_out, room.is_image, true), 0.99);
  EXPECT_LT(fraction(built->left_out, room.is_image, false), 0.002);
  EXPECT_LT(farthest_wall(*built), kMirror + 0.2);
  EXPECT_THAT(built->notes, Contains(HasSubstr("images in a mirror")));
}

TEST_P(MirrorImages, AreLeftOutWithoutRaysWhereTheyShowLessThanTheRoom) {
  MirroredRoom room = mirrored_room(GetParam(), 0.3);
  room.cloud.viewpoints.clear(), room.cloud.scans.clear();
  const auto built = build_model(room.cloud);
  ASSERT_TRUE(built) << built.error().message;
  EXPECT_GT(fraction(built->left_out, room.is_image, true), 0.95);
  EXPECT_LT(fraction(built->left_out, room.is_image, false), 0.002);
  EXPECT_LT(farthest_wall(*built), kMirror + 0.2);
}

TEST_P(MirrorImages, AreDoubtfulInVoxelMaps) {
  const MirroredRoom room = mirrored_room(GetParam(), 1);
  std::set<std::array<int, 3>> voxels;
  cloud::PointCloud<Cloud> map;
  for (const Eigen::Vector3f& p : room.cloud.points) {
    const Eigen::Array3i voxel = (p.array() / 0.05F).floor().cast<int>();
    if (voxels.insert({voxel.x(), voxel.y(), voxel.z()}).second)
      map.points.push_back(((voxel.cast<float>() + 0.5F) * 0.05F).matrix());
  }
  const auto built = build_model(map);
  ASSERT_TRUE(built) << built.error().message;
  EXPECT_TRUE(built->left_out.empty());
  EXPECT_TRUE(doubts_images(quality_of(*built)));
}

TEST_P(MirrorImages, RoomsThatWereBuiltAlikeAreNone) {
  // Two rooms, mirrored about the middle of a wall of 10 cm with a doorway. A third of the second was
  // measured.
  test::CloudSampler sampler = furnished_room(GetParam(), 500);
  cloud::PointCloud<Cloud> cloud;
  for (const Eigen::Vector3f& p : sampler.cloud().points) {
    if (p.x() > kMirror - 0.05 && p.y() > 2 && p.y() < 2.9 && p.z() < 2.05) continue;
    cloud.points.push_back(p);
    if (sampler.uniform() < 0.3)
      cloud.points.emplace_back(static_cast<float>(2 * kMirror + 0.1) - p.x(), p.y(), p.z());
  }
  const auto built = build_model(cloud);
  ASSERT_TRUE(built) << built.error().message;
  EXPECT_TRUE(built->mirrors.empty());
  EXPECT_TRUE(built->left_out.empty());
}

TEST_P(MirrorImages, ARoomBehindTheMirrorsWallStays) {
  // It is seen from a third place, and has other things in it.
  MirroredRoom room = mirrored_room(GetParam(), 0.3);
  room.cloud.viewpoints.emplace_back(9, 2, 1.5);
  test::CloudSampler behind(300, 0.004, GetParam() + 100);
  behind.room({kMirror + 0.12, 0}, {10.3, 6.2}, 0, 2.7);
  behind.slab({8, 4}, {9.3, 4.7}, 0.74);
  behind.wall({7, 5}, {7.8, 5}, 0, 1.2);
  for (const Eigen::Vector3f& p : behind.cloud().points) room.add(p.cast<double>(), 2, false);
  const auto built = build_model(room.cloud);
  ASSERT_TRUE(built) << built.error().message;
  EXPECT_GT(fraction(built->left_out, room.is_image, true), 0.9);
  EXPECT_LT(fraction(built->left_out, room.is_image, false), 0.002);
}

TEST_P(MirrorImages, ARoomThroughADoorwayBesideTheMirrorStays) {
  const MirroredRoom mirrored = mirrored_room(GetParam(), 0.3);
  MirroredRoom room;
  room.cloud.viewpoints = mirrored.cloud.viewpoints;
  const Eigen::AlignedBox3d door(Eigen::Vector3d(kMirror - 0.05, 4.25, 0),
                                 Eigen::Vector3d(kMirror + 0.2, 4.95, 2.05));
  for (std::size_t i = 0; i < mirrored.is_image.size(); ++i) {
    const Eigen::Vector3d p = mirrored.cloud.points[i].cast<double>();
    if (mirrored.is_image[i] || !door.contains(p)) room.add(p, mirrored.cloud.scans[i], mirrored.is_image[i]);
  }
  test::CloudSampler behind(1500, 0.004, GetParam() + 200);
  behind.room({kMirror + 0.12, 3}, {10.3, 9}, 0, 2.7);
  for (const double x : {7.1, 8.3, 9.4}) {
    behind.wall({x, 5.2}, {x, 7.5}, 0, 1.4);
    behind.slab({x, 5.2}, {x + 0.5, 7.5}, 1.4);
  }
  for (const Eigen::Vector3f& point : behind.cloud().points) {
    const Eigen::Vector3d p = point.cast<double>(), &from = room.cloud.viewpoints[0];
    const Eigen::Vector3d at = from + (kMirror - from.x()) / (p.x() - from.x()) * (p - from);
    if (door.contains(at)) room.add(p, 0, false);
  }
  const auto built = build_model(room.cloud);
  ASSERT_TRUE(built) << built.error().message;
  EXPECT_GT(fraction(built->left_out, room.is_image, true), 0.9);
  EXPECT_LT(fraction(built->left_out, room.is_image, false), 0.002);
}

/// The room, and of a room alike behind x = kMirror the fraction `seen` of what is seen through what
/// `is_open`.
template <class IsOpen>
MirroredRoom rooms_built_alike(std::uint64_t seed, double seen, IsOpen&& is_open) {
  MirroredRoom rooms;
  rooms.cloud.viewpoints = {{1.5, 2.2, 1.7}};
  test::CloudSampler sampler = furnished_room(seed, 500);
  for (const Eigen::Vector3f& point : sampler.cloud().points) {
    const Eigen::Vector3d p = point.cast<double>(), beyond(2 * kMirror - p.x(), p.y(), p.z());
    const bool between = p.x() > kMirror - 0.05 && p.z() > 0.05 && p.z() < 2.65;
    if (!between || !is_open(p)) rooms.add(between ? p - Eigen::Vector3d(0.02, 0, 0) : p, 0, false);
    const Eigen::Vector3d& from = rooms.cloud.viewpoints[0];
    const Eigen::Vector3d at = from + (kMirror - from.x()) / (beyond.x() - from.x()) * (beyond - from);
    if (!between && is_open(at) && sampler.uniform() < seen) rooms.add(beyond, 0, false);
  }
  return rooms;
}

TEST_P(MirrorImages, AnOfficeAlikeOnBothSidesOfAScreenStays) {
  for (const bool glazed : {false, true}) {
    const MirroredRoom rooms = rooms_built_alike(GetParam(), 0.5, [&](const Eigen::Vector3d& at) {
      return glazed ? at.z() > 0.4 && at.z() < 2.3 && at.y() > 0.5 && at.y() < 4.5 : at.z() > 1.4;
    });
    const auto built = build_model(rooms.cloud);
    ASSERT_TRUE(built) << built.error().message;
    EXPECT_TRUE(built->left_out.empty()) << "glazed: " << glazed;
  }
}

TEST_P(MirrorImages, ARoomAlikeSeenThroughADoorwayStays) {
  for (const bool rays : {false, true}) {
    MirroredRoom rooms = rooms_built_alike(GetParam(), 1, [](const Eigen::Vector3d& at) {
      return at.y() > 1.5 && at.y() < 3.4 && at.z() < 2.05;
    });
    if (!rays) rooms.cloud.viewpoints.clear(), rooms.cloud.scans.clear();
    const auto built = build_model(rooms.cloud);
    ASSERT_TRUE(built) << built.error().message;
    EXPECT_TRUE(built->left_out.empty()) << "rays: " << rays;
  }
}

TEST_P(MirrorImages, AnUpperStoreyOverTheImagesStays) {
  MirroredRoom room = mirrored_room(GetParam(), 0.3, 900);
  test::CloudSampler upper(150, 0.004, GetParam() + 300);
  upper.room({0, 0}, {2 * kMirror, 5}, 3, 5.7);
  for (const Eigen::Vector3f& p : upper.cloud().points) room.add(p.cast<double>(), 0, false);
  room.cloud.viewpoints.clear(), room.cloud.scans.clear();
  const auto built = build_model(room.cloud);
  ASSERT_TRUE(built) << built.error().message;
  ASSERT_FALSE(built->mirrors.empty());
  if (built->mirrors[0].certain) {
    EXPECT_GT(fraction(built->left_out, room.is_image, true), 0.9);
  }
  EXPECT_LT(fraction(built->left_out, room.is_image, false), 0.002);
}

TEST_P(MirrorImages, OfBothMirrorsOfALongWallAreLeftOut) {
  const MirroredRoom one = mirrored_room(GetParam(), 0.3), other = mirrored_room(GetParam() + 10, 0.3);
  const Eigen::Vector3d away(0, 30, 0);
  MirroredRoom both = one;
  for (const Eigen::Vector3d& viewpoint : one.cloud.viewpoints)
    both.cloud.viewpoints.emplace_back(viewpoint + away);
  for (std::size_t i = 0; i < other.is_image.size(); ++i)
    both.add(other.cloud.points[i].cast<double>() + away, other.cloud.scans[i] + 2U, other.is_image[i]);
  const auto built = build_model(both.cloud);
  ASSERT_TRUE(built) << built.error().message;
  EXPECT_EQ(built->mirrors.size(), 2U);
  EXPECT_GT(fraction(built->left_out, both.is_image, true), 0.97);
  EXPECT_LT(fraction(built->left_out, both.is_image, false), 0.002);
}

TEST_P(MirrorImages, AreNeverCertainWherePointsAreSparse) {
  const MirroredRoom room = mirrored_room(GetParam(), 0.3, 60);
  cloud::PointCloud<Map> cloud;
  cloud.points = room.cloud.points, cloud.scans = room.cloud.scans;
  cloud.viewpoints = room.cloud.viewpoints;
  const auto segmentation = segment(cloud);
  ASSERT_TRUE(segmentation) << segmentation.error().message;
  EXPECT_THAT(seen_in_mirrors(cloud, find_mirrors(cloud, *segmentation)), testing::IsEmpty());
}

TEST_P(MirrorImages, OneViewpointWithoutScansIsNoRay) {
  MirroredRoom room = mirrored_room(GetParam(), 0.3);
  room.cloud.viewpoints.resize(1), room.cloud.scans.clear();
  const auto built = build_model(room.cloud);
  ASSERT_TRUE(built) << built.error().message;
  ASSERT_EQ(built->mirrors.size(), 1U);
  EXPECT_FALSE(built->mirrors[0].rays);
  EXPECT_GT(fraction(built->left_out, room.is_image, true), 0.9);
}

TEST_P(MirrorImages, AreFoundFarFromTheOriginAndRaisedWithTheModel) {
  MirroredRoom room = mirrored_room(GetParam(), 0.3);
  const Eigen::Vector3d away(70'000, -50'000, 300);
  for (Eigen::Vector3f& p : room.cloud.points) p += away.cast<float>();
  for (Eigen::Vector3d& p : room.cloud.viewpoints) p += away;
  ModelOptions options;
  options.floor_to_zero = true;
  const auto built = build_model(room.cloud, options);
  ASSERT_TRUE(built) << built.error().message;
  ASSERT_EQ(built->mirrors.size(), 1U);
  EXPECT_NEAR(built->mirrors[0].low, kGlass.min().z(), 0.15);
  EXPECT_NEAR(built->mirrors[0].high, kGlass.max().z(), 0.15);
  EXPECT_GT(fraction(built->left_out, room.is_image, true), 0.97);
}

TEST(MirrorSamples, AreOfAllRingsOfAScanner) {
  // 140,000 points become samples of every seventh; each seventh is of the same ring.
  constexpr int kPoints = 140'000, kRings = 7;
  cloud::PointCloud<Map> cloud;
  for (int i = 0; i < kPoints; ++i)
    cloud.points.emplace_back(static_cast<float>(i % kRings), 0.0001F * static_cast<float>(i), 0.0F);
  Segmentation segmentation;
  segmentation.surface_of.assign(cloud.size(), kNoSurface);
  const SampledSite site = sampled_site(cloud, segmentation);
  const auto of_first = std::count_if(site.samples.begin(), site.samples.end(),
                                      [](const SitePoint& sample) { return sample.p.x() < 0.5; });
  EXPECT_NEAR(static_cast<double>(of_first) / static_cast<double>(site.samples.size()), 1.0 / kRings, 0.02);
}

INSTANTIATE_TEST_SUITE_P(Seeds, MirrorImages, testing::Values(1, 2, 3));

}  // namespace
}  // namespace parhelion::semantic
