// What depth images tell of the colour images that were taken with them.
#include "fusion/semantic/texture/movers.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "fusion/semantic/texture/model_surface.hpp"
#include "tests/fusion/semantic/painted_room.hpp"

namespace parhelion::semantic {
namespace {

using test::PaintedRoom;

/// Every `step`th pixel.
DepthView coarse(const DepthView& view, int step) {
  const Pinhole& c = view.camera;
  DepthView result = view;
  result.camera = {(c.width + step - 1) / step,
                   (c.height + step - 1) / step,
                   c.fx / step,
                   c.fy / step,
                   c.cx / step,
                   c.cy / step};
  result.millimetres.clear();
  for (int row = 0; row < c.height; row += step)
    for (int column = 0; column < c.width; column += step)
      result.millimetres.push_back(view.millimetres[c.at(column, row)]);
  return result;
}

/// Without `margin` pixels at each side.
DepthView narrow(const DepthView& view, int margin) {
  const Pinhole& c = view.camera;
  DepthView result = view;
  result.camera = {c.width - 2 * margin, c.height - 2 * margin, c.fx, c.fy, c.cx - margin, c.cy - margin};
  result.millimetres.clear();
  for (int row = margin; row < c.height - margin; ++row)
    for (int column = margin; column < c.width - margin; ++column)
      result.millimetres.push_back(view.millimetres[c.at(column, row)]);
  return result;
}

class CompareDepth : public ::testing::Test {
 protected:
  /// `change`: of all depth images.
  template <class Change>
  std::vector<Witnessed> compare(const Change& change, const Eigen::Vector2d* walker) {
    const auto poses = PaintedRoom::round(12);
    pose_ = poses[0];
    std::vector<DepthView> others;
    for (const auto& pose : poses) others.push_back(change(PaintedRoom::depth(pose, random_)));
    const DepthView depth = change(PaintedRoom::depth(pose_, random_, walker));
    const ColourView colour = PaintedRoom::colour(pose_, 1, walker);
    const QuadSurface surface = surface_of(PaintedRoom::model(), 0.05);
    return compare_depth(geometry_of(surface, colour), depth,
                         std::vector<std::uint8_t>(depth.camera.pixels()), others, {});
  }

  /// Shares of the pixels that show the walker and of those that do not, which are said to contradict.
  std::pair<double, double> contradicted(const std::vector<Witnessed>& witnessed,
                                         const Eigen::Vector2d& walker) {
    double hits[2] = {}, pixels[2] = {};
    for (int row = 0; row < PaintedRoom::kHeight; ++row) {
      for (int column = 0; column < PaintedRoom::kWidth; ++column) {
        const bool shows = PaintedRoom::cast(pose_, column, row, &walker).walker;
        pixels[shows ? 0 : 1] += 1;
        hits[shows ? 0 : 1] +=
            witnessed[PaintedRoom::camera().at(column, row)] == Witnessed::contradicts ? 1 : 0;
      }
    }
    return {hits[0] / pixels[0], hits[1] / pixels[1]};
  }

  Transform<Map, CameraOptical> pose_;
  std::mt19937 random_{3};
};

TEST_F(CompareDepth, ADepthImageCoarserThanTheColourImageFindsWhoStandsThere) {
  const Eigen::Vector2d walker(1.4, 1.0);
  for (const int step : {1, 2, 4, 6}) {
    const auto witnessed = compare([&](const DepthView& view) { return coarse(view, step); }, &walker);
    const auto [found, wrong] = contradicted(witnessed, walker);
    EXPECT_GT(found, 0.9) << step;
    EXPECT_LT(wrong, 0.15) << step;
  }
}

TEST_F(CompareDepth, ACoarseDepthImageLeavesNoHolesBetweenItsPixels) {
  for (const int step : {2, 4, 6}) {
    const auto witnessed = compare([&](const DepthView& view) { return coarse(view, step); }, nullptr);
    EXPECT_EQ(std::count(witnessed.begin(), witnessed.end(), Witnessed::agrees), std::ssize(witnessed))
        << step;
  }
}

TEST_F(CompareDepth, WhatLiesOutsideTheDepthCamerasViewIsNoHole) {
  const auto witnessed = compare([](const DepthView& view) { return narrow(view, 30); }, nullptr);
  EXPECT_EQ(std::count(witnessed.begin(), witnessed.end(), Witnessed::unmeasured), 0);
}

TEST_F(CompareDepth, AHoleWhereOthersMeasuredIsUnmeasured) {
  int images = 0;
  const auto witnessed = compare(
      [&](DepthView view) {
        if (++images == 13)  // after the others, the one that is compared
          for (int row = 40; row < 110; ++row)
            for (int column = 60; column < 140; ++column) view.millimetres[view.camera.at(column, row)] = 0;
        return view;
      },
      nullptr);
  EXPECT_GT(std::count(witnessed.begin(), witnessed.end(), Witnessed::unmeasured), 4000);
}

}  // namespace
}  // namespace parhelion::semantic
