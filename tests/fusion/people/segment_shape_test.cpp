#include "fusion/people/segment_shape.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "fusion/people/segments.hpp"
#include "tests/fusion/people/crowd_shapes.hpp"

namespace parhelion::people {
namespace {

/// What a laser at the origin with 0.25 degrees between its beams sees.
std::vector<Return> returns_of(const std::vector<test::Shape>& shapes) {
  std::vector<Return> returns;
  for (int i = -200; i <= 200; ++i) {
    const double angle = i * 0.25 * 3.14159265358979 / 180;
    const Eigen::Vector2d ray(std::cos(angle), std::sin(angle));
    double range = 10;
    for (const test::Shape& shape : shapes) range = std::min(range, hit(shape, {0, 0}, ray));
    if (range < 10) returns.push_back({range * ray, range, static_cast<std::uint32_t>(i + 200)});
  }
  return returns;
}

double concavity(const std::vector<test::Shape>& shapes) {
  return shape_of(returns_of(shapes), {0, 0}).concavity;
}

TEST(SegmentShape, two_legs_in_one_segment_have_a_valley) {
  using test::disc, test::Source;
  EXPECT_GT(concavity({disc({2, 0.07}, 0.07, Source::person), disc({2, -0.07}, 0.07, Source::person)}), 0.03);
  EXPECT_GT(concavity({disc({2, 0.06}, 0.06, Source::person), disc({2.1, -0.06}, 0.07, Source::person)}),
            0.03);
}

TEST(SegmentShape, bins_and_boxes_have_none) {
  EXPECT_LT(concavity({test::disc({2, 0}, 0.15, test::Source::furniture)}), 0.002);
  std::vector<test::Shape> box;
  add_box(box, {2, 0, 0.5}, 0.3, 0.4, test::Source::furniture);
  EXPECT_LT(concavity(box), 0.002);
}

TEST(SegmentShape, of_one_return_is_nothing) {
  const std::vector<Return> one{{{1, 0}, 1, 0}};
  EXPECT_EQ(shape_of(one, {0, 0}).concavity, 0);
}

}  // namespace
}  // namespace parhelion::people
