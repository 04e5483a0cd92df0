// Floors that bow are floor up to their ends, and low things on them are not.
#include "fusion/semantic/segmentation/floor_points.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "protocols/model.hpp"

namespace parhelion::semantic {
namespace {

/// A floor of 6 m x 3 m with points every 2 cm at the heights that `height` gives; those up to 2 cm
/// are labelled floor.
struct LabelledFloor {
  static constexpr auto kFloor = static_cast<std::uint8_t>(EntityLabel::floor);
  cloud::PointCloud<Map> cloud;
  std::vector<std::uint8_t> labels;

  explicit LabelledFloor(const auto& height) {
    for (int i = 0; i < 300; ++i) {
      for (int k = 0; k < 150; ++k) {
        const double x = 0.02 * (i + 0.5), y = 0.02 * (k + 0.5), z = height(x, y);
        cloud.points.emplace_back(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
        labels.push_back(z < 0.02 ? kFloor : static_cast<std::uint8_t>(EntityLabel::unknown));
      }
    }
  }
  /// Of the points higher than z.
  double floor_fraction_above(double z) const {
    double all = 0, floor = 0;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      if (static_cast<double>(cloud.points[i].z()) <= z) continue;
      ++all;
      floor += labels[i] == kFloor ? 1 : 0;
    }
    return all > 0 ? floor / all : 0;
  }
};

TEST(GrowFloors, AFloorThatBowsAtItsEndIsFloor) {
  LabelledFloor bowed([](double x, double) { return x < 3 ? 0 : 0.012 * (x - 3) * (x - 3); });
  grow_floors(bowed.cloud, bowed.labels);
  EXPECT_GT(bowed.floor_fraction_above(0.02), 0.95);
}

TEST(GrowFloors, AFloorThatEndsAtADropIsFloor) {
  LabelledFloor landing([](double x, double) { return x < 2.4 ? 0 : x < 3 ? 0.055 * (x - 2.4) : -0.3; });
  ASSERT_EQ(landing.floor_fraction_above(0.02), 0);
  grow_floors(landing.cloud, landing.labels);
  EXPECT_GT(landing.floor_fraction_above(0.02), 0.95);
}

TEST(GrowFloors, ALowThingWithRoundFlanksIsNone) {
  LabelledFloor body([](double x, double y) {
    const double r = std::hypot((x - 3) / 0.9, (y - 1.5) / 0.35);
    return r < 1 ? 0.06 * (1 + std::cos(3.14 * r)) : 0.0;
  });
  ASSERT_EQ(body.floor_fraction_above(0.06), 0);
  grow_floors(body.cloud, body.labels);
  EXPECT_LT(body.floor_fraction_above(0.06), 0.02);
}

TEST(GrowFloors, ALowThingBeforeAWallIsNone) {
  LabelledFloor box([](double x, double) { return x < 5.4 ? 0 : 0.2 * (x - 5.4); });
  grow_floors(box.cloud, box.labels);
  EXPECT_LT(box.floor_fraction_above(0.09), 0.02);
}

}  // namespace
}  // namespace parhelion::semantic
