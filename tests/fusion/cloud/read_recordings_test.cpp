// Readers on real scans, with the figures of their ATTRIBUTION.md.
#include <algorithm>

#include "fusion/cloud/bucket_grid.hpp"
#include "fusion/cloud/read_cloud.hpp"
#include "protocols/quantile.hpp"
#include "tests/recordings.hpp"

namespace parhelion::cloud {
namespace {

constexpr float kMinRange = 0.48F;  // m; nearer points are not valid (3DTK's config.ini)

/// The heights of floor and ceiling in the attribution files come from histograms of scans that are not
/// level: the fullest layer of 5 cm within 0.25 m of `z` agrees with them to one and a half layers.
constexpr double kLayerTolerance = 0.075;  // m
double densest_layer(const PointCloud<Scanner>& cloud, double z) {
  std::array<int, 10> counts{};
  for (const Eigen::Vector3f& p : cloud.points) {
    const double layer = (static_cast<double>(p.z()) - z + 0.25) / 0.05;
    if (p.norm() > kMinRange && layer >= 0 && layer < 10) ++counts[static_cast<std::size_t>(layer)];
  }
  const auto best = std::max_element(counts.begin(), counts.end()) - counts.begin();
  return z - 0.25 + 0.05 * static_cast<double>(best) + 0.025;
}

/// Median distance, m, of every 20th point of `cloud` to its nearest in `target` (at most 1 m away).
double median_distance(const PointCloud<Scanner>& target, const PointCloud<Scanner>& cloud,
                       const Transform<Cloud, Scanner>& T) {
  const BucketGrid grid(target.points, 1.0);
  std::vector<float> distances;
  for (std::size_t i = 0; i < cloud.size(); i += 20) {
    if (cloud.points[i].norm() < kMinRange) continue;
    const Eigen::Vector3f p = (T * cloud.points[i].cast<double>().eval()).cast<float>();
    float nearest = 1;
    grid.for_each_run(grid.bucket_of(p), [&](BucketGrid::Range run) {
      for (std::uint32_t k = run.begin; k < run.end; ++k) {
        nearest = std::min(nearest, (grid.sorted()[k] - p).norm());
      }
    });
    distances.push_back(nearest);
  }
  return static_cast<double>(median(distances));
}

TEST(ReadRecordings, compressed_pcd_room_has_correct_floor_and_ceiling_heights) {
  const auto path = test::recording("3d-room-scan/room_scan1.pcd");
  PARHELION_NEEDS_RECORDING(path);
  const auto scan = read_scan(path);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->cloud.size(), 112'586U);
  EXPECT_EQ(scan->not_finite, 0U);
  EXPECT_TRUE(scan->notes.empty());
  EXPECT_TRUE(scan->cloud.viewpoints.empty());
  EXPECT_NEAR(densest_layer(scan->cloud, -1.30), -1.30, kLayerTolerance);
  EXPECT_NEAR(densest_layer(scan->cloud, 1.65), 1.65, kLayerTolerance);
}

TEST(ReadRecordings, corridor_of_3dtk_is_metric_and_x_forward) {
  const auto path = test::recording("3d-3dtk-corridor/scan000.3d");
  PARHELION_NEEDS_RECORDING(path);
  const auto scan = read_scan(path);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->cloud.size(), 81'359U);
  EXPECT_NEAR(densest_layer(scan->cloud, -0.43), -0.43, kLayerTolerance);
  EXPECT_NEAR(densest_layer(scan->cloud, 2.00), 2.00, kLayerTolerance);
  // The solid wall is at x = +0.90 m of the left-handed file, which is to the right: y = -0.90 here.
  const auto near = [&scan](float y) {
    return std::count_if(scan->cloud.points.begin(), scan->cloud.points.end(),
                         [y](const Eigen::Vector3f& p) { return std::abs(p.y() - y) < 0.05F; });
  };
  EXPECT_GT(near(-0.90F), 5 * near(-0.4F));
  EXPECT_GT(near(1.45F), near(0.5F));
  float range = 0;
  for (const Eigen::Vector3f& p : scan->cloud.points) range = std::max(range, p.norm());
  EXPECT_NEAR(range, 32.8, 0.1);
}

TEST(ReadRecordings, pose_files_of_3dtk_align_their_scans) {
  const auto path = test::recording("3d-3dtk-corridor/scan000.3d");
  PARHELION_NEEDS_RECORDING(path);
  const auto target = read_scan(path);
  ASSERT_TRUE(target) << target.error().message;
  const double bounds[] = {0.085, 0.130};  // m; the first scan's is 0.2 without its pose
  for (const int i : {1, 2}) {
    const auto scan = read_scan(test::recording("3d-3dtk-corridor/scan00" + std::to_string(i) + ".3d"));
    ASSERT_TRUE(scan && scan->guess);
    const double median = median_distance(target->cloud, scan->cloud, *scan->guess);
    EXPECT_LT(median, bounds[i - 1]) << i;
    if (i == 1) {
      EXPECT_GT(median_distance(target->cloud, scan->cloud, {}), 1.5 * median);
    }
  }
}

TEST(ReadRecordings, binary_pcd_and_labelled_ply_have_their_points_and_labels) {
  const auto terrain = test::recording("3d-drc-terrain/tilted-steps.pcd");
  const auto labelled = test::recording("3d-s3dis-labelled-crop/s3dis_crop.ply");
  const auto stairs = test::recording("3d-ori-stairs/06.pcd");
  PARHELION_NEEDS_RECORDING(terrain);
  PARHELION_NEEDS_RECORDING(labelled);
  PARHELION_NEEDS_RECORDING(stairs);
  EXPECT_EQ(read_scan(terrain)->cloud.size(), 181'648U);
  const auto steps = read_scan(stairs);
  ASSERT_TRUE(steps) << steps.error().message;
  EXPECT_EQ(steps->cloud.size(), 107'772U);
  EXPECT_NEAR(densest_layer(steps->cloud, 0.59), 0.59, kLayerTolerance);
  EXPECT_EQ(steps->cloud.colours.size(), steps->cloud.size());
  const auto crop = read_scan(labelled);
  ASSERT_TRUE(crop) << crop.error().message;
  EXPECT_EQ(crop->cloud.size(), 41'568U);
  ASSERT_EQ(crop->cloud.labels.size(), crop->cloud.size());
  ASSERT_EQ(crop->cloud.colours.size(), crop->cloud.size());
  double floor = 0, count = 0;
  for (std::size_t i = 0; i < crop->cloud.size(); ++i) {
    if (crop->cloud.labels[i] == 1) floor += static_cast<double>(crop->cloud.points[i].z()), ++count;
  }
  EXPECT_GT(count, 10'000);
  EXPECT_LT(floor / count, 0.05);
}

}  // namespace
}  // namespace parhelion::cloud
